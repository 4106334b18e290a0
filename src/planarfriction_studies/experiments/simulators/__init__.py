"""Patch friction inside simulators beside their own at its best settings: held, shaken, stopped, turned, timed.

Needs MuJoCo; Drake is compared with where it is installed."""
