"""The cases of scripts/prove: each measures one property and fills its part of a results page."""
