//! What steps allocate, and what a large netlist holds.
#![allow(
    missing_docs,
    unsafe_code,
    reason = "a counting allocator is unsafe by its trait"
)]

mod systems;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use circ::integrate::step::Scheme;
use circ::integrate::theta::{Setup, Start, Stepping, Theta};
use circ::integrate::{Log, Stepper};
use circ::settings::Settings;
use nalgebra::dvector;

struct Counting;

thread_local! {
    /// Of this thread: the test harness has threads of its own.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    /// Bytes that this thread asked for and has not given back.
    static HELD: Cell<usize> = const { Cell::new(0) };
}

fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

// SAFETY: every call is passed on to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
        let _ = HELD.try_with(|held| held.set(held.get().wrapping_add(layout.size())));
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        let _ = HELD.try_with(|held| held.set(held.get().wrapping_sub(layout.size())));
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn cached_steps_do_not_allocate() {
    for scheme in [Scheme::MOREAU, Scheme::MIDPOINT] {
        let lcs = systems::bridge();
        let owned = lcs.clone();
        let mut theta = Theta::new(Setup {
            reduce: Box::new(move |_| Ok(owned.clone())),
            position: vec![],
            thresholds: vec![],
            t: 0.0,
            start: Start::State(dvector![10.0, 0.0]),
            scheme,
            stepping: Stepping::Fixed(1e-8),
            longest: f64::INFINITY,
            settings: Settings::default(),
        })
        .expect("a stepper");
        let mut log = Log::new(2, 0.0, false);
        let mut row = [0.0; 2];
        theta.advance(1e-5, &mut log).expect("a step");
        theta.read(&mut row);
        let (steps, before) = (theta.stats().steps, allocations());
        // 0.1 ms without a change of the active set: 9000 steps in one stretch.
        theta.advance(1e-4, &mut log).expect("steps");
        let made = allocations() - before;
        assert_eq!(theta.stats().steps - steps, 9000);
        assert_eq!(made, 0);
    }
}

/// Steps of circuits with exponential diodes, whose lengths the error chooses: once every length has been met, only those before a stop are new.
#[test]
fn steps_of_curved_laws_do_not_allocate() {
    let text = "half wave\nvs in 0 sin(0 10 50)\nd1 in out dm\nc1 out 0 100u\nr1 out 0 1k\n.model dm d(is=1e-12 n=1.5 rs=0.1)\n.tran 1m 1\n.end\n";
    let model = circ::Model::parse(text, "half-wave.cir").expect("a netlist");
    let lcs = model.lcs().expect("a system");
    let owned = lcs.clone();
    let mut theta = Theta::new(Setup {
        reduce: Box::new(move |_| Ok(owned.clone())),
        position: vec![],
        thresholds: vec![],
        t: 0.0,
        start: Start::State(nalgebra::DVector::zeros(lcs.n())),
        scheme: Scheme::MIDPOINT,
        stepping: Stepping::Controlled {
            span: 1.0,
            first: 1e-5,
        },
        longest: f64::INFINITY,
        settings: Settings::default(),
    })
    .expect("a stepper");
    let mut log = Log::new(1, 0.0, false);
    let mut made = |until: f64| {
        let (steps, before) = (theta.stats().steps, allocations());
        theta.advance(until, &mut log).expect("steps");
        (theta.stats().steps - steps, allocations() - before)
    };
    made(0.2);
    let (few, first) = made(0.4);
    let (many, second) = made(1.0);
    assert!(many > 2 * few && few > 100, "{few} and {many} steps");
    // Matrices of the two lengths before the stop.
    assert!(
        second <= first.max(200),
        "{first} and {second} allocations in {few} and {many} steps"
    );
}

/// Cards, circuit and equations of a ladder, by element.
#[test]
fn an_element_of_a_large_netlist_takes_less_than_two_kilobytes() {
    let sections = 4000;
    let mut text = String::from("ladder\nv1 n0 0 sin(0 10 1k)\n");
    for k in 0..sections {
        text += &format!("r{k} n{k} n{} 10\nc{k} n{} 0 10n\n", k + 1, k + 1);
    }
    text += ".tran 1u 1m\n.save v(n1)\n.end\n";
    let before = HELD.with(Cell::get);
    let model = circ::Model::parse(&text, "ladder.cir").expect("a netlist");
    let held = HELD.with(Cell::get) - before;
    let elements = model.circuit().elements.len();
    assert!(held < 1900 * elements, "{} bytes", held / elements);
}
