//! How deep a point of the last frame lies on its ray.
