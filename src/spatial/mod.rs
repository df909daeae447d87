//! Searching in space: points near a point, triangles near a triangle.
