//! The sources as an autonomous linear system: z' = S z, u = H z between breakpoints.

use nalgebra::DMatrix;

use super::spectrum::Rate;
use crate::circuit::Source;
use crate::circuit::source::{Oscillation, Piece, Wave, decayed};

/// (sine part, cosine part) of a term τ seconds after its origin; for frequency 0 the first alone is the term.
fn pair(term: &Oscillation, tau: f64) -> (f64, f64) {
    let envelope = term.amplitude * decayed(term.decay, tau);
    let (s, c) = (term.frequency * tau + term.phase).sin_cos();
    (envelope * s, envelope * c)
}

/// What a column of z carries.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Column {
    /// The constant 1.
    One,
    /// constant + slope (t − origin) of an input; its slope follows.
    Line { input: usize },
    /// A value that is constant between breakpoints.
    Step { input: usize },
    /// The slope of the column before.
    Slope { input: usize },
    /// Sine part of an input's wave; the cosine part follows unless omega is 0.
    Wave {
        input: usize,
        damping: f64,
        omega: f64,
    },
    /// The cosine part of the column before.
    Quadrature,
    /// e^{−damping t} sin omega t and cos omega t for all inputs that last the whole run.
    Shared { damping: f64, omega: f64 },
}

/// The exosystem of all sources of a circuit. The structure (S, H) stays, the vector z is set at breakpoints.
#[derive(Debug, Clone, Default)]
pub(crate) struct Exosystem {
    columns: Vec<Column>,
    generator: DMatrix<f64>,
    output: DMatrix<f64>,
    rates: Vec<Rate>,
    /// Current pieces by input; blank for inputs left out.
    pieces: Vec<Piece>,
    /// Inputs left out: they count as 0.
    silent: Vec<bool>,
}

/// What the pieces of one input over a run are made of.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shape {
    /// More than one piece.
    pub(crate) changes: bool,
    /// Some piece has a slope.
    pub(crate) sloped: bool,
    /// (damping, omega) that occur.
    pub(crate) waves: Vec<(f64, f64)>,
}

impl Shape {
    /// What a source's pieces on [from, until] are made of; `None` if it has no closed form.
    fn of_source(source: &Source, from: f64, until: f64) -> Option<Self> {
        let straight = |sloped: bool| Self {
            changes: true,
            sloped,
            waves: Vec::new(),
        };
        match &source.wave {
            Wave::Pulse {
                v1, v2, rise, fall, ..
            } if v1 != v2 => Some(straight(*rise > 0.0 || *fall > 0.0)),
            Wave::Pwl { points, .. } => Some(straight(
                points
                    .windows(2)
                    .any(|w| w[1].0 > w[0].0 && w[1].1 != w[0].1),
            )),
            _ => {
                let mut pieces = vec![source.piece(from)?];
                while let Some(last) = pieces.last().filter(|p| p.end < until) {
                    pieces.push(source.piece(last.end)?);
                }
                Some(Self::of(&pieces))
            }
        }
    }

    /// The union over pieces.
    pub(crate) fn of<'a>(pieces: impl IntoIterator<Item = &'a Piece>) -> Self {
        let mut shape = Self::default();
        for (k, piece) in pieces.into_iter().enumerate() {
            shape.changes |= k > 0;
            shape.sloped |= piece.slope != 0.0;
            for term in piece.terms() {
                let key = (term.decay, term.frequency);
                if !shape.waves.contains(&key) {
                    shape.waves.push(key);
                }
            }
        }
        shape
    }
}

impl Exosystem {
    /// The exosystem of these sources over [from, until], those that are `silent` left out; `None` if one has no closed form. Where they
    /// are `free` each may be given another value at any time.
    pub(crate) fn of(
        sources: &[Source],
        silent: Vec<bool>,
        (from, until): (f64, f64),
        free: bool,
    ) -> Option<Self> {
        let blank = Source {
            dc: 0.0,
            wave: Wave::Dc(0.0),
        };
        let mut shapes = Vec::new();
        let mut first = Vec::new();
        for (source, silent) in sources.iter().zip(&silent) {
            let source = if *silent { &blank } else { source };
            let piece = source.piece(from)?;
            let mut shape = Shape::of_source(source, from, until)?;
            shape.changes |= free;
            shapes.push(shape);
            first.push(piece);
        }
        Some(Self {
            silent,
            ..Self::new(&shapes, first)
        })
    }

    /// The structure for inputs of these shapes, standing on their first pieces.
    pub(crate) fn new(shapes: &[Shape], first: Vec<Piece>) -> Self {
        let mut columns = vec![Column::One];
        let mut output: Vec<(usize, usize, f64)> = Vec::new();
        for (input, (shape, piece)) in shapes.iter().zip(&first).enumerate() {
            if shape.changes || shape.sloped {
                output.push((input, columns.len(), 1.0));
                if shape.sloped {
                    columns.push(Column::Line { input });
                    columns.push(Column::Slope { input });
                } else {
                    columns.push(Column::Step { input });
                }
            } else if piece.constant != 0.0 {
                output.push((input, 0, piece.constant));
            }
            for &(damping, omega) in &shape.waves {
                if shape.changes || damping != 0.0 {
                    output.push((input, columns.len(), 1.0));
                    columns.push(Column::Wave {
                        input,
                        damping,
                        omega,
                    });
                    if omega != 0.0 {
                        columns.push(Column::Quadrature);
                    }
                    continue;
                }
                let shared = Column::Shared { damping, omega };
                let at = columns
                    .iter()
                    .position(|c| *c == shared)
                    .unwrap_or_else(|| {
                        columns.push(shared);
                        columns.push(Column::Quadrature);
                        columns.len() - 2
                    });
                for term in piece
                    .terms()
                    .filter(|t| (t.decay, t.frequency) == (damping, omega))
                {
                    let (s, c) = (term.phase - omega * piece.origin).sin_cos();
                    output.push((input, at, term.amplitude * c));
                    output.push((input, at + 1, term.amplitude * s));
                }
            }
        }
        let dim = columns.len();
        let mut generator = DMatrix::zeros(dim, dim);
        let mut rates = Vec::new();
        for (k, column) in columns.iter().enumerate() {
            match *column {
                Column::Line { .. } => generator[(k, k + 1)] = 1.0,
                Column::Wave { damping, omega, .. } | Column::Shared { damping, omega } => {
                    rates.push(Rate {
                        decay: damping,
                        frequency: omega.abs(),
                    });
                    generator[(k, k)] = -damping;
                    if omega != 0.0 {
                        generator[(k, k + 1)] = omega;
                        generator[(k + 1, k)] = -omega;
                        generator[(k + 1, k + 1)] = -damping;
                    }
                }
                Column::One | Column::Step { .. } | Column::Slope { .. } | Column::Quadrature => {}
            }
        }
        let mut h = DMatrix::zeros(shapes.len(), dim);
        for (i, j, value) in output {
            h[(i, j)] += value;
        }
        Self {
            columns,
            generator,
            output: h,
            rates,
            silent: vec![false; first.len()],
            pieces: first,
        }
    }

    /// Whether another has the same S and H, and its columns mean the same.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        self.columns == other.columns
            && self.generator == other.generator
            && self.output == other.output
    }

    /// Whether inputs on these pieces have the same S and H: lines that slope where these do, else the same constants.
    pub(crate) fn holds(&self, pieces: &[Piece]) -> bool {
        let alike = |(own, other): (&Piece, &Piece)| {
            let straight = own.terms().next().is_none() && other.terms().next().is_none();
            let slope = [own, other].map(|piece| piece.slope != 0.0);
            straight && slope[0] == slope[1] && (slope[0] || own.constant == other.constant)
        };
        self.pieces.len() == pieces.len() && self.pieces.iter().zip(pieces).all(alike)
    }

    /// Inputs go on along these.
    pub(crate) fn set_pieces(&mut self, pieces: &[Piece]) {
        self.pieces.clone_from_slice(pieces);
    }

    /// By input whether it is left out.
    pub(super) fn silent(&self) -> &[bool] {
        &self.silent
    }

    /// Length of z; z[0] = 1.
    pub(crate) fn dim(&self) -> usize {
        self.columns.len()
    }

    /// S.
    pub(crate) fn generator(&self) -> &DMatrix<f64> {
        &self.generator
    }

    /// H, p×dim.
    pub(crate) fn output(&self) -> &DMatrix<f64> {
        &self.output
    }

    /// Eigenvalues of S that move.
    pub(crate) fn rates(&self) -> &[Rate] {
        &self.rates
    }

    /// Appends z' = S z.
    pub(crate) fn rates_at(&self, z: &[f64], rates: &mut Vec<f64>) {
        let rate = |k: usize| match self.columns[k] {
            Column::Line { .. } => z[k + 1],
            Column::Wave { damping, omega, .. } | Column::Shared { damping, omega } => {
                let turned = if omega == 0.0 { 0.0 } else { omega * z[k + 1] };
                turned - damping * z[k]
            }
            // Of the wave before it.
            Column::Quadrature => match self.columns[k - 1] {
                Column::Wave { damping, omega, .. } | Column::Shared { damping, omega } => {
                    -omega * z[k - 1] - damping * z[k]
                }
                _ => 0.0,
            },
            Column::One | Column::Step { .. } | Column::Slope { .. } => 0.0,
        };
        rates.extend((0..self.columns.len()).map(rate));
    }

    /// The piece that input i stands on.
    pub(crate) fn piece(&self, input: usize) -> &Piece {
        &self.pieces[input]
    }

    /// Input i goes on along another piece, unless it is left out.
    pub(crate) fn set_piece(&mut self, input: usize, piece: Piece) {
        if !self.silent[input] {
            self.pieces[input] = piece;
        }
    }

    /// The next breakpoint, s.
    pub(crate) fn next_breakpoint(&self) -> f64 {
        let ends = self.pieces.iter().map(|piece| piece.end);
        ends.fold(
            f64::INFINITY,
            |first, end| if end < first { end } else { first },
        )
    }

    /// Raises `sizes` to what z and, of its waves, their amplitudes are: a sine at zero is not small.
    pub(crate) fn envelope(&self, z: &[f64], sizes: &mut [f64]) {
        for (k, size) in sizes.iter_mut().enumerate() {
            let wave = |k: usize| self.columns.get(k) == Some(&Column::Quadrature);
            let whole = if wave(k) {
                z[k].hypot(z[k - 1])
            } else if wave(k + 1) {
                z[k].hypot(z[k + 1])
            } else {
                z[k].abs()
            };
            *size = size.max(whole);
        }
    }

    /// z(t) on the current pieces, from closed forms.
    pub(crate) fn write(&self, t: f64, z: &mut [f64]) {
        for (k, column) in self.columns.iter().enumerate() {
            match *column {
                Column::One => z[k] = 1.0,
                Column::Line { input } => {
                    let piece = &self.pieces[input];
                    z[k] = piece.constant + piece.slope * (t - piece.origin);
                }
                Column::Step { input } => z[k] = self.pieces[input].constant,
                Column::Slope { input } => z[k] = self.pieces[input].slope,
                Column::Wave {
                    input,
                    damping,
                    omega,
                } => {
                    let piece = &self.pieces[input];
                    let (mut sine, mut cosine) = (0.0, 0.0);
                    for term in piece
                        .terms()
                        .filter(|w| (w.decay, w.frequency) == (damping, omega))
                    {
                        let (s, c) = pair(term, t - piece.origin);
                        sine += s;
                        cosine += c;
                    }
                    z[k] = sine;
                    if omega != 0.0 {
                        z[k + 1] = cosine;
                    }
                }
                Column::Shared { damping, omega } => {
                    let envelope = decayed(damping, t);
                    let (s, c) = (omega * t).sin_cos();
                    z[k] = envelope * s;
                    z[k + 1] = envelope * c;
                }
                Column::Quadrature => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    fn source(wave: Wave) -> Source {
        Source { dc: 0.0, wave }
    }

    fn sine(amplitude: f64, damping: f64, phase: f64, delay: f64) -> Source {
        source(Wave::Sin {
            offset: 0.5,
            amplitude,
            frequency: 3.0,
            delay,
            damping,
            phase,
            cycles: None,
        })
    }

    /// Pieces that an exosystem holds are those for which another one would be alike.
    #[test]
    fn pieces_are_held_where_another_system_would_be_alike() {
        let line = |constant: f64, slope: f64| Wave::Pwl {
            points: vec![(0.0, constant), (1.0, constant + slope)],
            repeat: None,
            delay: 0.0,
        };
        let piece = |wave: Wave| source(wave).piece(0.5).unwrap();
        let of = |pieces: &[Piece]| {
            let shapes: Vec<Shape> = pieces.iter().map(|piece| Shape::of([piece])).collect();
            Exosystem::new(&shapes, pieces.to_vec())
        };
        let all = [
            [piece(Wave::Dc(4.0)), piece(line(1.0, 2.0))],
            [piece(Wave::Dc(4.0)), piece(line(3.0, -1.0))],
            [piece(Wave::Dc(5.0)), piece(line(1.0, 2.0))],
            [piece(Wave::Dc(4.0)), piece(line(1.0, 0.0))],
            [
                sine(2.0, 0.0, 30.0, 0.0).piece(0.5).unwrap(),
                piece(line(1.0, 2.0)),
            ],
        ];
        for (k, own) in all.iter().enumerate() {
            for (l, other) in all.iter().enumerate() {
                let (held, alike) = (of(own).holds(other), of(own).is_alike(&of(other)));
                // Waves are compared by what they make.
                assert_eq!(held, alike && k < 4, "{k} {l}");
            }
        }
        let mut moved = of(&all[0]);
        moved.set_pieces(&all[1]);
        let (mut z, mut expected) = (vec![0.0; moved.dim()], vec![0.0; moved.dim()]);
        moved.write(0.75, &mut z);
        of(&all[1]).write(0.75, &mut expected);
        assert_eq!(z, expected);
    }

    /// H z(t) is the source and H S z(t) its derivative, for every kind of column, across breakpoints.
    #[test]
    fn reproduces_sources_and_their_derivatives() {
        let sources = vec![
            source(Wave::Pwl {
                points: vec![(0.0, 1.0), (1.0, 3.0), (2.0, -1.0)],
                repeat: None,
                delay: 0.0,
            }),
            source(Wave::Pwl {
                points: vec![(0.0, 1.0), (0.5, 1.0), (0.5, 4.0)],
                repeat: None,
                delay: 0.0,
            }),
            sine(2.0, 0.0, 30.0, 0.0),
            sine(3.0, 0.0, -60.0, 0.0),
            sine(1.5, 2.0, 10.0, 0.25),
            source(Wave::Exp {
                v1: 1.0,
                v2: 2.0,
                rise_delay: 0.1,
                rise_tau: 0.3,
                fall_delay: 0.7,
                fall_tau: 0.2,
            }),
            source(Wave::Dc(4.0)),
        ];
        let mut exosystem =
            Exosystem::of(&sources, vec![false; sources.len()], (0.0, 3.0), false).unwrap();
        // one, a line 2, a step 1, one shared pair, a step and a damped pair, a step and two decays
        assert_eq!(exosystem.dim(), 1 + 2 + 1 + 2 + 3 + 3);
        let mut z = DVector::zeros(exosystem.dim());
        for t in [0.0, 0.05, 0.2, 0.3, 0.5, 0.71, 1.0, 1.7, 2.5] {
            for (i, source) in sources.iter().enumerate() {
                exosystem.set_piece(i, source.piece(t).unwrap());
            }
            exosystem.write(t, z.as_mut_slice());
            let u = exosystem.output() * &z;
            let dz = exosystem.generator() * &z;
            let mut rates = Vec::new();
            exosystem.rates_at(z.as_slice(), &mut rates);
            for (rate, expected) in rates.iter().zip(dz.iter()) {
                assert!((rate - expected).abs() <= 1e-15 * expected.abs(), "{rate}");
            }
            let du = exosystem.output() * dz;
            for (i, source) in sources.iter().enumerate() {
                assert!(
                    (u[i] - source.value(t)).abs() < 1e-14 * 8.0,
                    "input {i} at {t}"
                );
                assert!(
                    (du[i] - source.derivative(t)).abs() < 1e-12,
                    "input {i} at {t}"
                );
            }
        }
        assert_eq!(exosystem.next_breakpoint(), f64::INFINITY);
    }
}
