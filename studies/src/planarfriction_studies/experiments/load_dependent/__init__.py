"""A contact pressure that follows the load: distributed, and reduced with all kept, the table rescaled, or rebuilt."""
