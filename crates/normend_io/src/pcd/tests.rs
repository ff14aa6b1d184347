//! Reading, rewriting and writing PCD.
