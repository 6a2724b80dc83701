"""What rubber loses on the waves of rough ice, of a scene: tables, a page."""
