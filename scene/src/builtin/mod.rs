//! Built-in scenes, made by code.
