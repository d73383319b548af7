//! Equations of motion, bodies and impulsive manoeuvres for spaceflight.
