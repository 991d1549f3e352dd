use super::args::BenchArgs;
use super::exit::{Exit, Failure};
use super::streams::Streams;
pub(super) fn bench(_: &BenchArgs, _: &Streams) -> Result<Exit, Failure> {
    Ok(Exit::Done)
}
