//! Readers and writers of the file formats people have.
