"""Steps at a held twist, and one implicit step of bodies on patches."""
