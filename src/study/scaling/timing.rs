//! How long a piece of work takes, how long its bytes take through memory, and how much memory the program holds.

use std::hint::black_box;
use std::time::{Duration, Instant};

use rayon::prelude::*;

/// Least and median time of one run: over at least 15 runs and a quarter of a second, at least 3 where one takes
/// longer than a fifth of a second, and only one more where it takes longer than two seconds.
pub fn repeated(work: &mut dyn FnMut()) -> [Duration; 2] {
    let first = Instant::now();
    work();
    let took = first.elapsed();
    let long = took > Duration::from_millis(200);
    let again = Instant::now();
    if !long {
        work();
    }
    // Runs too short for the clock are taken by the dozen.
    let batch = if long { 1 } else { (20e-6 / again.elapsed().as_secs_f64().max(1e-9)).clamp(1.0, 1000.0) as u32 };
    let least = match took.as_secs() {
        2.. => 1,
        _ if long => 3,
        _ => 15,
    };
    let (mut times, begin) = (Vec::new(), Instant::now());
    while times.len() < least || (begin.elapsed() < Duration::from_millis(250) && times.len() < 2000) {
        let start = Instant::now();
        for _ in 0..batch {
            work();
        }
        times.push(start.elapsed() / batch);
    }
    times.sort_unstable();
    [times[0], times[times.len() / 2]]
}

/// Reads everything once and writes everything once, on the threads at hand, in pieces of the same proportion.
pub fn stream(read: &[f64], written: &mut [f64]) {
    let pieces = if read.len() < 100_000 { 1 } else { 64 };
    let (r, w) = (read.len().div_ceil(pieces).max(1), written.len().div_ceil(pieces).max(1));
    let pass = |(read, written): (&[f64], &mut [f64])| {
        pulp::Arch::new().dispatch(|| {
            let mut sums = [0.0; 16];
            for chunk in read.chunks_exact(16) {
                for (s, v) in sums.iter_mut().zip(chunk) {
                    *s += v;
                }
            }
            written.fill(sums.iter().sum());
        });
    };
    if pieces == 1 {
        pass((read, written));
    } else {
        read.par_chunks(r).zip(written.par_chunks_mut(w)).for_each(pass);
    }
}

/// Median time to stream so many bytes: two thirds of them read, one third written, as F = −KX has it.
pub fn streamed(bytes: usize) -> Duration {
    let numbers = (bytes / 8).max(3);
    let read = vec![1.0_f64; numbers - numbers / 3];
    let mut written = vec![0.0_f64; numbers / 3];
    repeated(&mut || stream(black_box(&read), &mut written))[1]
}

/// The most memory that the program held since [`forget_peak`], MB; none where the system does not say.
pub fn peak_mb() -> Option<f64> {
    of_status("VmHWM:")
}

/// Begins to look for the peak anew, where the system can.
pub fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

fn of_status(name: &str) -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with(name))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_time_is_not_above_the_median_and_everything_is_written() {
        let mut runs = 0_u32;
        let [least, median] = repeated(&mut || runs += 1);
        assert!(least <= median && runs >= 15);
        let mut written = vec![0.0; 10];
        stream(&[1.0; 32], &mut written);
        assert_eq!(written, [32.0; 10]);
        let mut many = vec![0.0; 100];
        stream(&vec![1.0; 204_800], &mut many);
        // 64 pieces of 3200 numbers; 100 places are filled by the first 50 of them.
        assert_eq!(many, [3200.0; 100]);
    }
}
