//! The largest of neighbouring numbers, in logarithmic time.

/// A segment tree: leaf `i` of `n` is node `n + i`, node `k` holds the larger of nodes `2k` and `2k + 1`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RangeMaximum {
    nodes: Vec<f64>,
}

impl RangeMaximum {
    /// Of numbers that are not negative, at least one.
    pub(super) fn new(numbers: impl ExactSizeIterator<Item = f64>) -> Self {
        let n = numbers.len();
        let mut nodes = vec![0.0; n];
        nodes.extend(numbers);
        for k in (1..n).rev() {
            nodes[k] = f64::max(nodes[2 * k], nodes[2 * k + 1]);
        }
        Self { nodes }
    }

    /// The largest of numbers `first … last`.
    pub(super) fn of(&self, first: usize, last: usize) -> f64 {
        let n = self.nodes.len() / 2;
        let (mut low, mut end) = (n + first, n + last + 1);
        let mut largest = 0.0_f64;
        while low < end {
            if low % 2 == 1 {
                largest = largest.max(self.nodes[low]);
                low += 1;
            }
            if end % 2 == 1 {
                end -= 1;
                largest = largest.max(self.nodes[end]);
            }
            low /= 2;
            end /= 2;
        }
        largest
    }

    /// The largest of all.
    pub(super) fn of_all(&self) -> f64 {
        self.nodes[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_every_range_of_small_lists_against_a_scan() {
        for n in 1..20_usize {
            let numbers: Vec<f64> = (0..n).map(|i| (i * 7919 % 31) as f64).collect();
            let tree = RangeMaximum::new(numbers.iter().copied());
            for first in 0..n {
                for last in first..n {
                    let scan = numbers[first..=last].iter().copied().fold(0.0, f64::max);
                    assert_eq!(tree.of(first, last), scan, "{first}..={last} of {n}");
                }
            }
            assert_eq!(tree.of_all(), tree.of(0, n - 1));
        }
    }
}
