//! An independent solution: complex nodal analysis at one frequency, in doubles, with every branch current an unknown.

use nalgebra::{Complex, DMatrix, DVector};

use crate::circuit::{Affine, Circuit, ElementId, Kind, Output, Quantity};

pub(super) type C64 = Complex<f64>;

/// What a device, function or switch is in a nodal solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Branch {
    /// v = value.
    Voltage(f64),
    /// i = value.
    Current(f64),
    /// v = R i.
    Resistance(f64),
}

/// Node potentials and branch currents of a circuit at complex frequency s.
///
/// `source` gives the value of each independent source, `branch` what each device is.
pub(super) struct Nodal {
    v: Vec<C64>,
    i: Vec<C64>,
    /// Ratio of the largest to the smallest pivot of the equilibrated matrix.
    pub(super) condition: f64,
}

impl Nodal {
    pub(super) fn solve(
        circuit: &Circuit,
        s: C64,
        source: &dyn Fn(&str) -> f64,
        branch: &dyn Fn(&str) -> Branch,
    ) -> Option<Self> {
        let (nodes, branches) = (circuit.nodes.len(), circuit.elements.len());
        let size = nodes + branches;
        let mut m = DMatrix::<C64>::zeros(size, size);
        let mut rhs = DVector::<C64>::zeros(size);
        let one = C64::new(1.0, 0.0);
        let real = |x: f64| C64::new(x, 0.0);
        for (k, e) in circuit.elements.iter().enumerate() {
            let (p, n, i) = (e.p.index(), e.n.index(), nodes + k);
            m[(p, i)] += one;
            m[(n, i)] -= one;
            let voltage = |m: &mut DMatrix<C64>, c: C64| {
                m[(i, p)] += c;
                m[(i, n)] -= c;
            };
            let affine = |m: &mut DMatrix<C64>, control: &Affine| {
                for (gain, quantity) in &control.terms {
                    let column = match quantity {
                        Quantity::Voltage(node) => node.index(),
                        Quantity::Current(ElementId(k)) => nodes + *k as usize,
                    };
                    m[(i, column)] -= real(gain.f64);
                }
            };
            match &e.kind {
                Kind::Resistor(r) => {
                    voltage(&mut m, one);
                    m[(i, i)] -= real(r.f64);
                }
                Kind::Capacitor(c) => {
                    voltage(&mut m, s * c.f64);
                    m[(i, i)] -= one;
                }
                Kind::Inductor(l) => {
                    voltage(&mut m, one);
                    m[(i, i)] -= s * l.f64;
                    for coupling in &circuit.couplings {
                        let id = ElementId(k as u32);
                        let other = match (coupling.a == id, coupling.b == id) {
                            (true, _) => coupling.b,
                            (_, true) => coupling.a,
                            _ => continue,
                        };
                        let Kind::Inductor(l2) = &circuit.elements[other.index()].kind else {
                            continue;
                        };
                        m[(i, nodes + other.index())] -=
                            s * coupling.k.f64 * (l.f64 * l2.f64).sqrt();
                    }
                }
                Kind::VoltageSource(_) => {
                    voltage(&mut m, one);
                    rhs[i] = real(source(&e.name));
                }
                Kind::CurrentSource(_) => {
                    m[(i, i)] += one;
                    rhs[i] = real(source(&e.name));
                }
                Kind::Controlled {
                    output: Output::Voltage,
                    control,
                } => {
                    voltage(&mut m, one);
                    affine(&mut m, control);
                }
                Kind::Controlled {
                    output: Output::Current,
                    control,
                } => {
                    m[(i, i)] += one;
                    affine(&mut m, control);
                }
                Kind::Device(_) | Kind::Switch(_) | Kind::Function { .. } => {
                    match branch(&e.name) {
                        Branch::Voltage(v) => {
                            voltage(&mut m, one);
                            rhs[i] = real(v);
                        }
                        Branch::Current(x) => {
                            m[(i, i)] += one;
                            rhs[i] = real(x);
                        }
                        Branch::Resistance(r) => {
                            voltage(&mut m, one);
                            m[(i, i)] -= real(r);
                        }
                    }
                }
            }
        }
        // One reference per island: its current law is replaced by potential 0.
        let mut island: Vec<usize> = (0..nodes).collect();
        for _ in 0..nodes {
            for e in &circuit.elements {
                let low = island[e.p.index()].min(island[e.n.index()]);
                island[e.p.index()] = low;
                island[e.n.index()] = low;
            }
        }
        for k in (0..nodes).filter(|&k| island[k] == k) {
            m.row_mut(k).fill(C64::new(0.0, 0.0));
            m[(k, k)] = one;
            rhs[k] = C64::new(0.0, 0.0);
        }
        equilibrate(&mut m, &mut rhs);
        let lu = m.clone().full_piv_lu();
        let pivots: Vec<f64> = lu.u().diagonal().iter().map(|x| x.norm()).collect();
        let (least, most) = pivots
            .iter()
            .fold((f64::MAX, 0.0f64), |(a, b), &x| (a.min(x), b.max(x)));
        let mut x = lu.solve(&rhs)?;
        // Refined, so that small unknowns beside large ones are right too.
        for _ in 0..2 {
            x += lu.solve(&(&rhs - &m * &x))?;
        }
        Some(Self {
            v: x.iter().take(nodes).copied().collect(),
            i: x.iter().skip(nodes).copied().collect(),
            condition: most / least,
        })
    }

    pub(super) fn voltage(&self, circuit: &Circuit, name: &str) -> C64 {
        let e = &circuit.elements[circuit.element(name).unwrap().index()];
        self.v[e.p.index()] - self.v[e.n.index()]
    }

    pub(super) fn current(&self, circuit: &Circuit, name: &str) -> C64 {
        self.i[circuit.element(name).unwrap().index()]
    }

    /// The varying part of an affine quantity.
    pub(super) fn affine(&self, affine: &Affine) -> C64 {
        affine
            .terms
            .iter()
            .fold(C64::new(0.0, 0.0), |sum, (gain, quantity)| {
                let value = match quantity {
                    Quantity::Voltage(node) => self.v[node.index()],
                    Quantity::Current(id) => self.i[id.index()],
                };
                sum + value * gain.f64
            })
    }

    /// What rounding in this solution can amount to, for voltages and for currents, with branches of about 1 Ω to 1 kΩ.
    pub(super) fn floor(&self) -> (f64, f64) {
        let largest = |x: &[C64]| x.iter().fold(0.0f64, |m, x| m.max(x.norm()));
        let (v, i) = (largest(&self.v), largest(&self.i));
        (1e-12 * (v + 1e3 * i), 1e-12 * (i + v))
    }

    pub(super) fn potential(&self, node: usize) -> C64 {
        self.v[node]
    }
}

/// Row scaling by powers of two; columns keep their meaning.
fn equilibrate(m: &mut DMatrix<C64>, rhs: &mut DVector<C64>) {
    for k in 0..m.nrows() {
        let largest = m.row(k).iter().fold(0.0f64, |a, x| a.max(x.norm()));
        if largest > 0.0 {
            let scale = C64::new(largest.log2().round().exp2().recip(), 0.0);
            m.row_mut(k).iter_mut().for_each(|x| *x *= scale);
            rhs[k] *= scale;
        }
    }
}
