//! Lock-up: an axis that saturates and does not recover.
//!
//! The position loop around a velocity PI is conditionally stable: too little gain destabilises it, and a clamped voltage is
//! too little gain. A reference that the drive cannot follow can therefore leave it swinging between both voltage limits
//! for good, or pinned at one of them while the error stays.

use std::fmt;

/// How a locked axis behaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LockupKind {
    /// The voltage swings between both limits.
    LimitCycle,
    /// The voltage stays at one limit.
    Pinned,
}

/// A lock-up that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lockup {
    /// How it behaves.
    pub kind: LockupKind,
    /// When the saturation began that it did not recover from \[s\].
    pub since_s: f64,
    /// When it was certain \[s\].
    pub time_s: f64,
    /// Largest tracking error of the axis at that time \[mm\].
    pub error_mm: f64,
}

impl fmt::Display for LockupKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::LimitCycle => "a limit cycle: the voltage swings between both of its limits",
            Self::Pinned => "the voltage is pinned at its limit",
        })
    }
}

/// Half of the time that an axis is given to recover \[s\].
///
/// The paper's axes come back from a step of 100 mm/s in the feed after 0.12 s, and from saturated accelerations to 200 mm/s in
/// 0.19 s: less than two such halves.
const HALF_S: f64 = 0.125;

/// An axis that has not saturated for this long \[s\] has recovered.
const QUIET_S: f64 = 0.05;

/// Recovering means that error or saturation fall below this share from one half to the next.
const RECOVERING: f64 = 0.8;

/// One half of the watch.
#[derive(Debug, Clone, Copy, Default)]
struct Half {
    saturated: u32,
    swings: u32,
    error_mm: f64,
}

/// A stretch of saturation without a quiet time in it.
#[derive(Debug, Clone, Copy)]
struct Episode {
    began: u64,
    last_saturated: u64,
    last_voltage: f64,
    before: Option<Half>,
    now: Half,
    half_began: u64,
}

/// Watches one axis for lock-up.
///
/// From the first saturated sample on it compares stretches of 0.125 s: where neither the share of saturated samples
/// nor the largest tracking error falls by a fifth from one stretch to the next, and no 0.05 s pass without saturation, the axis does
/// not recover.
#[derive(Debug, Clone)]
pub struct LockupWatch {
    period_s: f64,
    half: u64,
    quiet: u64,
    episode: Option<Episode>,
    found: bool,
}

impl LockupWatch {
    /// A watch for a loop with this control period.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a float cast saturates
    pub fn new(period_s: f64) -> Self {
        // A slow loop is given as many samples as it needs to swing a few times.
        let samples = |time_s: f64, least: u64| ((time_s / period_s).round() as u64).max(least);
        Self { period_s, half: samples(HALF_S, 25), quiet: samples(QUIET_S, 10), episode: None, found: false }
    }

    /// One sample: its number (rising from call to call), clamped voltage, whether the clamp acted, and the axis' tracking error. Returns the lock-up
    /// once, at the sample that makes it certain.
    #[inline]
    pub fn watch(&mut self, k: u64, voltage_v: f64, saturated: bool, error_mm: f64) -> Option<Lockup> {
        if !saturated && self.episode.is_none() {
            return None;
        }
        self.follow(k, voltage_v, saturated, error_mm)
    }

    fn follow(&mut self, k: u64, voltage_v: f64, saturated: bool, error_mm: f64) -> Option<Lockup> {
        let mut episode = self.episode.take().unwrap_or(Episode {
            began: k,
            last_saturated: k,
            last_voltage: voltage_v,
            before: None,
            now: Half::default(),
            half_began: k,
        });
        if k.saturating_sub(episode.last_saturated) > self.quiet {
            return None;
        }
        let now = &mut episode.now;
        now.error_mm = now.error_mm.max(error_mm.abs());
        now.swings += u32::from(voltage_v * episode.last_voltage < 0.0);
        episode.last_voltage = voltage_v;
        if saturated {
            now.saturated += 1;
            episode.last_saturated = k;
        }
        let mut lockup = None;
        if k.saturating_add(1).saturating_sub(episode.half_began) >= self.half {
            let now = std::mem::take(&mut episode.now);
            episode.half_began = k.saturating_add(1);
            if let Some(before) = episode.before.replace(now)
                && f64::from(now.saturated) >= RECOVERING * f64::from(before.saturated)
                && now.error_mm >= RECOVERING * before.error_mm
                && !self.found
            {
                self.found = true;
                let swings = now.swings + before.swings;
                lockup = Some(Lockup {
                    kind: if swings >= 3 { LockupKind::LimitCycle } else { LockupKind::Pinned },
                    since_s: episode.began as f64 * self.period_s,
                    time_s: k as f64 * self.period_s,
                    error_mm: now.error_mm,
                });
            }
        }
        self.episode = Some(episode);
        lockup
    }
}
