//! The JavaScript face of the core: convert, call one core function, convert back.
