//! Linking the parts of an offset end to start.

use super::raw::{Kept, NONE, Raw};

/// Most starts that are looked at near an end.
const MOST_NEAR: usize = 100;

/// For each part the one that follows it; or which parts have a loose end or start.
pub(super) fn link(raw: &[Raw], kept: &[Kept], reach: f64) -> Result<Vec<usize>, Vec<bool>> {
    let mut next = vec![NONE; kept.len()];
    let mut taken = vec![false; kept.len()];
    // Where the raw pieces go on into each other; the kept parts are in the order of the raw pieces.
    for (k, part) in kept.iter().enumerate() {
        if !part.whole_end {
            continue;
        }
        let Some(follower) = raw[part.raw].next else { continue };
        let at = kept.partition_point(|other| other.raw < follower);
        if let Some(other) = kept.get(at)
            && other.raw == follower
            && other.whole_start
        {
            next[k] = at;
            taken[at] = true;
        }
    }
    // The rest by distance, the nearest first; the wider reach is for what no near one was found for.
    for reach in [1e-3 * reach, reach] {
        let mut starts: Vec<(f64, usize)> =
            (0..kept.len()).filter(|&k| !taken[k]).map(|k| (kept[k].curve.start.x, k)).collect();
        starts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut pairs = Vec::new();
        for k in (0..kept.len()).filter(|&k| next[k] == NONE) {
            let end = kept[k].curve.end;
            let first = starts.partition_point(|s| s.0 < end.x - reach);
            let near = starts[first..].iter().take_while(|s| s.0 <= end.x + reach);
            // A rest that is all within reach would make too many pairs.
            let gaps = near.map(|s| ((kept[s.1].curve.start - end).norm(), k, s.1)).filter(|pair| pair.0 <= reach);
            pairs.extend(gaps.take(MOST_NEAR));
        }
        pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, k, s) in pairs {
            // A part that ends where it starts is a crumb, not a ring.
            if next[k] == NONE && !taken[s] && (k != s || kept[k].curve.length() > 4.0 * reach) {
                next[k] = s;
                taken[s] = true;
            }
        }
    }
    if next.contains(&NONE) {
        return Err((0..kept.len()).map(|k| next[k] == NONE || !taken[k]).collect());
    }
    Ok(next)
}
