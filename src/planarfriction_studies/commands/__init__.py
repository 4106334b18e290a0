"""Commands that the studies add to the command line: `definitions` holds their options, one module each their work."""
