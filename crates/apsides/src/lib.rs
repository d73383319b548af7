//! Spaceflight trajectory optimisation: missions, pipelines and verified results.
