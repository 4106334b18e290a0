"""Commands that the studies add to the command line."""
