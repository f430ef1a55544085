//! Numbers as people read them: as many digits as they carry, a true minus sign, and a value with its error.

/// A number with that many significant digits, without an exponent.
pub fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "–".to_owned() };
    }
    let decimals = (digits - 1 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.decimals$}");
    if all_zeros(&text) {
        return fixed(0.0, 2);
    }
    // 0.0996 to two digits is 0.10, not 0.100.
    let carried = text.parse::<f64>().is_ok_and(|v| v.abs().log10().floor() > value.abs().log10().floor());
    let text = if carried && decimals > 0 { format!("{value:.*}", decimals - 1) } else { text };
    if text.starts_with('-') { text.replacen('-', "−", 1) } else { text }
}

/// "−0.12": with so many decimals, and without a sign before nothing but zeros.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if all_zeros(rest) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

fn all_zeros(text: &str) -> bool {
    text.chars().all(|c| matches!(c, '-' | '0' | '.'))
}

/// "0.140 ± 0.021": the value with as many decimals as its error has to two digits; with one more where the value would read as
/// nothing but zeros: "0.2 ± 11.0", not "0 ± 11".
pub fn with_error(value: f64, error: Option<f64>) -> String {
    let Some(error) = error.filter(|e| *e >= 1e-6 && e.is_finite()) else { return significant(value, 3) };
    let two_digits = (1 - error.log10().floor() as i32).clamp(0, 6) as usize;
    let reads_as_zero = |decimals: usize| all_zeros(&format!("{value:.decimals$}"));
    let more = value != 0.0 && reads_as_zero(two_digits) && (two_digits == 0 || !reads_as_zero(two_digits + 1));
    let decimals = two_digits + usize::from(more);
    format!("{} ± {error:.decimals$}", fixed(value, decimals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_show_the_digits_that_they_carry() {
        assert_eq!(significant(0.1446, 3), "0.145");
        assert_eq!(significant(-1234.5, 3), "−1234");
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(significant(0.0996, 2), "0.10");
        assert_eq!(significant(f64::NAN, 2), "–");
        assert_eq!(significant(-7.1e-15, 3), "0.00");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(fixed(-0.126, 2), "−0.13");
    }

    #[test]
    fn a_value_has_the_decimals_of_its_error_and_is_never_rounded_away() {
        assert_eq!(with_error(0.1446, Some(0.0213)), "0.145 ± 0.021");
        assert_eq!(with_error(-0.1446, None), "−0.145");
        assert_eq!(with_error(0.1779, Some(10.977)), "0.2 ± 11.0");
        assert_eq!(with_error(0.04, Some(1.23)), "0.04 ± 1.23");
        assert_eq!(with_error(37.2, Some(10.977)), "37 ± 11");
        assert_eq!(with_error(-0.0001, Some(0.5)), "0.00 ± 0.50", "two more digits would only say the error twice");
        assert_eq!(with_error(0.0, Some(0.5)), "0.00 ± 0.50");
    }
}
