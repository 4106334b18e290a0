"""The reduced model as published, and the limit surfaces that it reads."""
