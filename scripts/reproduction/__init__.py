"""Parts of the scripts that measure the package."""
