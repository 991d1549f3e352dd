//! CPU time, where the platform tells it.

#[cfg(not(target_family = "wasm"))]
pub(super) use cpu_time::ThreadTime;

/// A clock that stands still: WebAssembly has no CPU time, and runs there say that they took 0 s.
#[cfg(target_family = "wasm")]
#[derive(Debug, Clone, Copy)]
pub(super) struct ThreadTime;

#[cfg(target_family = "wasm")]
impl ThreadTime {
    pub(super) const fn now() -> Self {
        Self
    }

    pub(super) const fn elapsed(&self) -> std::time::Duration {
        std::time::Duration::ZERO
    }
}
