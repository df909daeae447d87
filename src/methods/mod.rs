//! Surfaces fitted to data, one folder a method.
