//! Regular grids of intensities, and what is read from them.
