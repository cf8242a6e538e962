//! Logs one after another on one axis of time.

/// Times that never run back: where they do, another log begins, a little after the one before. Also the longest step
/// that is no gap, and whether there are several logs.
pub(crate) fn one_after_another(time: &[f64]) -> (Vec<f64>, f64, bool) {
    let mut steps: Vec<f64> =
        time.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
    let gap = 10.0 * usual;
    let (mut shift, mut several) = (0.0, false);
    let mut running = Vec::with_capacity(time.len());
    for (index, value) in time.iter().enumerate() {
        if index > 0 && *value < time[index - 1] {
            several = true;
            shift += time[index - 1] - value + 2.0 * gap;
        }
        running.push(value + shift);
    }
    (running, gap, several)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_log_stands_after_the_first_with_a_gap() {
        let (time, gap, several) = one_after_another(&[0.0, 1.0, 2.0, 0.5, 1.5]);
        assert!(several && gap == 10.0);
        assert_eq!(time, [0.0, 1.0, 2.0, 22.0, 23.0]);
        assert!(one_after_another(&[]).0.is_empty());
    }
}
