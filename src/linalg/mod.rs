//! Dense linear algebra of the sizes of circuits: what the exact integrator needs and general-purpose libraries do not have, each a
//! function of matrices that knows nothing of circuits; and sparse factors for the steps of large ones.

pub(crate) mod blocks;
pub(crate) mod decouple;
pub(crate) mod dense;
pub(crate) mod eigenvalues;
pub(crate) mod expm;
pub(crate) mod gauss;
pub(crate) mod gramian;
pub(crate) mod kernel;
pub(crate) mod krylov;
pub(crate) mod levelled;
pub(crate) mod pencil;
pub(crate) mod polynomial;
pub(crate) mod powers;
pub(crate) mod product;
pub(crate) mod quadratic;
pub(crate) mod rays;
pub(crate) mod refill;
pub(crate) mod series;
pub(crate) mod shifted;
pub(crate) mod sparse_lu;
pub(crate) mod whole;
