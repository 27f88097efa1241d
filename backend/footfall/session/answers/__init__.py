"""What a session tells of itself as plain JSON, as types: made by its parts, described and sent by the interface."""
