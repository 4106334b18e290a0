"""Drift: a disc under a load that friction holds, with plain and with elasto-plastic bristles."""
