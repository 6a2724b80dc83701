"""Programs that set up, show and test the project, and the studies behind the pages of docs/."""
