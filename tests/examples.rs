//! The example programs do what they say; each checks its own result.
#![allow(missing_docs, reason = "tests")]

#[path = "../examples/built.rs"]
mod built;
#[path = "../examples/controller.rs"]
mod controller;
#[path = "../examples/events.rs"]
mod events;
#[path = "../examples/matrices.rs"]
mod matrices;
#[path = "../examples/observer.rs"]
mod observer;
#[path = "../examples/sweep.rs"]
mod sweep;

#[test]
fn every_example_runs() -> Result<(), Box<dyn std::error::Error>> {
    built::main()?;
    controller::main()?;
    events::main()?;
    matrices::main()?;
    observer::main()?;
    sweep::main()
}
