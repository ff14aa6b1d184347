//! Tests of LAS and LAZ files.
