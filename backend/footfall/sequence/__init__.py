"""Plans become commands here; the rules that a sequence must keep, the edits it allows, what it predicts."""
