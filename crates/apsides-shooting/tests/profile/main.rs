//! Control profiles: decoding, flights to closed forms, re-entry, failing flights, requests that are refused.
#![allow(clippy::unwrap_used)]

mod capsule;
mod closed_forms;
mod decode;
mod entry;
mod failures;
