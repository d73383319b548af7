//! Generic scalars and exact sparse derivatives of small vector functions.
