//! Benchmark problems of optimal control with sourced optima.
