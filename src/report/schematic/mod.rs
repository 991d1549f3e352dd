//! The circuit as a picture for readers: symbols, orthogonal wires, words beside their elements.
//!
//! `part` says what is drawn, `cards` finds it in a netlist; `search` says where, by `cost` and by the wires that `grid` finds it takes; `drawing` puts it on a
//! sheet with `symbol` and `words`. A schematic has places of its own, which `placed` keeps.

mod canvas;
mod cards;
mod cost;
mod drawing;
mod grid;
mod part;
mod placed;
mod search;
mod symbol;
#[cfg(test)]
mod tests;
mod words;

use super::PictureError;
use crate::model::Model;
use drawing::{Drawing, States};
use grid::Grid;
use part::Parts;

/// The most parts that are drawn.
const LARGEST: usize = 2000;

/// Draws the circuit of a model as its netlist says it, subcircuits as boxes; what is in `conducting` (names of elements) is coloured.
///
/// # Errors
/// [`PictureError::Empty`] without an element between two nodes, [`PictureError::Large`] from some thousand elements on.
pub fn svg(model: &Model, conducting: &[String]) -> Result<String, PictureError> {
    drawn(model, States::Of(conducting))
}

/// The same with what can conduct drawn twice, as groups of class `device` with `data-device` (its name) and `data-on` (1 where it conducts, and
/// hidden): a page shows one of the two.
///
/// # Errors
/// See [`svg`].
pub fn with_both_states(model: &Model) -> Result<String, PictureError> {
    drawn(model, States::Both)
}

fn drawn(model: &Model, states: States<'_>) -> Result<String, PictureError> {
    let circuit = model.circuit();
    let parts = match model.netlist() {
        Some(netlist) => cards::parts(netlist, model.sources(), circuit),
        None => Parts::of_circuit(circuit),
    };
    if parts.parts.is_empty() {
        return Err(PictureError::Empty("no element connects two nodes"));
    }
    if parts.parts.len() > LARGEST {
        return Err(PictureError::Large(parts.parts.len()));
    }
    if let Some(sheet) = model.netlist().and_then(|netlist| netlist.sheet.as_ref()) {
        return Ok(placed::draw(&parts, sheet, states, &circuit.title));
    }
    let plan = search::plan(&parts);
    let grid = Grid::of(&parts.parts, parts.nets.len(), &plan);
    Ok(Drawing::new(&parts, &plan, &grid, states).draw(&circuit.title))
}
