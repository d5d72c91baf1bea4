"""The cases of scripts/prove: each measures one thing and fills its part of a results page."""
