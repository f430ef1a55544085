//! What the times of a study depend on, in a line: processor, cores, system, and how the program was built.

/// "Intel … · 2 cores · linux x86_64 · frontalis 0.1.0, optimised".
pub fn words() -> String {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let built = if cfg!(debug_assertions) { "with checks, not for times" } else { "optimised" };
    let many = if cores == 1 { "core" } else { "cores" };
    format!(
        "{} · {cores} {many} · {} {} · frontalis {}, {built}",
        processor().unwrap_or_else(|| "processor unknown".to_owned()),
        std::env::consts::OS,
        std::env::consts::ARCH,
        env!("CARGO_PKG_VERSION")
    )
}

/// The name that the system gives to its first processor, where it gives one.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    let name = line.split_once(':')?.1.split_whitespace().collect::<Vec<_>>().join(" ");
    (!name.is_empty()).then_some(name)
}
