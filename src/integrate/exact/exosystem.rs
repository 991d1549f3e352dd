//! The sources as an autonomous linear system: z' = S z, u = H z between breakpoints.

use nalgebra::DMatrix;

use super::spectrum::Rate;

/// A source between two breakpoints:
/// u(t) = value + slope (t − from) + Σ amplitude·e^{−damping (t − from)}·sin(omega (t − from) + phase).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Piece {
    /// Start, s.
    pub(crate) from: f64,
    /// End, s; infinite for the last piece.
    pub(crate) to: f64,
    /// Constant term.
    pub(crate) value: f64,
    /// 1/s.
    pub(crate) slope: f64,
    /// Damped sinusoids.
    pub(crate) waves: Vec<Term>,
}

/// amplitude·e^{−damping τ}·sin(omega τ + phase).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Term {
    pub(crate) amplitude: f64,
    pub(crate) damping: f64,
    pub(crate) omega: f64,
    pub(crate) phase: f64,
}

impl Piece {
    /// Value and slope of the source at t.
    pub(crate) fn at(&self, t: f64) -> (f64, f64) {
        let tau = t - self.from;
        let mut value = self.value + self.slope * tau;
        let mut slope = self.slope;
        for term in &self.waves {
            let (s, c) = term.pair(tau);
            value += s;
            slope += term.omega * c - term.damping * s;
        }
        (value, slope)
    }
}

impl Term {
    /// (sine part, cosine part) after τ seconds; for omega = 0 the first alone is the term.
    fn pair(&self, tau: f64) -> (f64, f64) {
        let envelope = self.amplitude * (-self.damping * tau).exp();
        let (s, c) = (self.omega * tau + self.phase).sin_cos();
        (envelope * s, envelope * c)
    }
}

/// What a column of z carries.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Column {
    /// The constant 1.
    One,
    /// value + slope (t − from) of an input; its slope follows.
    Line { input: usize },
    /// A value that is constant between breakpoints.
    Step { input: usize },
    /// The slope of the column before.
    Slope { input: usize },
    /// Sine part of an input's wave; the cosine part follows unless omega is 0.
    Wave { input: usize, damping: f64, omega: f64 },
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
    /// Current pieces by input.
    pieces: Vec<Piece>,
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
    /// The union over pieces.
    pub(crate) fn of<'a>(pieces: impl IntoIterator<Item = &'a Piece>) -> Self {
        let mut shape = Self::default();
        for (k, piece) in pieces.into_iter().enumerate() {
            shape.changes |= k > 0;
            shape.sloped |= piece.slope != 0.0;
            for term in &piece.waves {
                let key = (term.damping, term.omega);
                if !shape.waves.contains(&key) {
                    shape.waves.push(key);
                }
            }
        }
        shape
    }
}

impl Exosystem {
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
            } else if piece.value != 0.0 {
                output.push((input, 0, piece.value));
            }
            for &(damping, omega) in &shape.waves {
                if shape.changes || damping != 0.0 {
                    output.push((input, columns.len(), 1.0));
                    columns.push(Column::Wave { input, damping, omega });
                    if omega != 0.0 {
                        columns.push(Column::Quadrature);
                    }
                    continue;
                }
                let shared = Column::Shared { damping, omega };
                let at = columns.iter().position(|c| *c == shared).unwrap_or_else(|| {
                    columns.push(shared);
                    columns.push(Column::Quadrature);
                    columns.len() - 2
                });
                for term in piece.waves.iter().filter(|t| (t.damping, t.omega) == (damping, omega)) {
                    let (s, c) = (term.phase - omega * piece.from).sin_cos();
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
                    rates.push(Rate { decay: damping, frequency: omega.abs() });
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
        Self { columns, generator, output: h, rates, pieces: first }
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

    /// The piece that input i stands on.
    pub(crate) fn piece(&self, input: usize) -> &Piece {
        &self.pieces[input]
    }

    /// Input i goes on along another piece.
    pub(crate) fn set_piece(&mut self, input: usize, piece: Piece) {
        self.pieces[input] = piece;
    }

    /// The next breakpoint, s.
    pub(crate) fn next_breakpoint(&self) -> f64 {
        self.pieces.iter().map(|p| p.to).fold(f64::INFINITY, f64::min)
    }

    /// z(t) on the current pieces, from closed forms.
    pub(crate) fn write(&self, t: f64, z: &mut [f64]) {
        for (k, column) in self.columns.iter().enumerate() {
            match *column {
                Column::One => z[k] = 1.0,
                Column::Line { input } => {
                    let piece = &self.pieces[input];
                    z[k] = piece.value + piece.slope * (t - piece.from);
                }
                Column::Step { input } => z[k] = self.pieces[input].value,
                Column::Slope { input } => z[k] = self.pieces[input].slope,
                Column::Wave { input, damping, omega } => {
                    let piece = &self.pieces[input];
                    let (mut sine, mut cosine) = (0.0, 0.0);
                    for term in piece.waves.iter().filter(|w| (w.damping, w.omega) == (damping, omega)) {
                        let (s, c) = term.pair(t - piece.from);
                        sine += s;
                        cosine += c;
                    }
                    z[k] = sine;
                    if omega != 0.0 {
                        z[k + 1] = cosine;
                    }
                }
                Column::Shared { damping, omega } => {
                    let envelope = (-damping * t).exp();
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

    fn sine(amplitude: f64, damping: f64, omega: f64, phase: f64, from: f64) -> Piece {
        Piece {
            from,
            to: f64::INFINITY,
            value: 0.5,
            slope: 0.0,
            waves: vec![Term { amplitude, damping, omega, phase }],
        }
    }

    /// H z(t) is the source and H S z(t) its derivative, for every kind of column.
    #[test]
    fn reproduces_sources_and_their_derivatives() {
        let line = Piece { from: 1.0, to: 2.0, value: 3.0, slope: -4.0, waves: vec![] };
        let step = Piece { from: 0.0, to: 2.0, value: 7.0, slope: 0.0, waves: vec![] };
        let pieces = vec![
            line.clone(),
            step.clone(),
            sine(2.0, 0.0, 10.0, 0.3, 0.0),
            sine(3.0, 0.0, 10.0, -1.0, 0.0),
            sine(1.5, 2.0, 7.0, 0.2, 0.25),
            sine(1.5, 3.0, 0.0, std::f64::consts::FRAC_PI_2, 0.5),
        ];
        let mut shapes: Vec<Shape> = pieces.iter().map(|p| Shape::of([p])).collect();
        shapes[1].changes = true;
        let exosystem = Exosystem::new(&shapes, pieces.clone());
        // one, line 2, step 1, one shared pair, a damped pair, a decay
        assert_eq!(exosystem.dim(), 1 + 2 + 1 + 2 + 2 + 1);
        let mut z = DVector::zeros(exosystem.dim());
        for t in [1.0, 1.1, 1.7] {
            exosystem.write(t, z.as_mut_slice());
            let u = exosystem.output() * &z;
            let du = exosystem.output() * (exosystem.generator() * &z);
            for (i, piece) in pieces.iter().enumerate() {
                let (value, slope) = piece.at(t);
                assert!((u[i] - value).abs() < 1e-14, "input {i}");
                assert!((du[i] - slope).abs() < 1e-13, "input {i}");
            }
        }
        assert_eq!(exosystem.next_breakpoint(), 2.0);
    }
}
