//! What the tests of sweeps share.

use std::fs;
use std::path::Path;

use servosim::scenario::Document;
use servosim::sweep::{Exported, Method, Metric, Plan, Session, Shard, Sweep, export};

pub const KPP: &str = "axes.x.pdff.kpp";

/// A short line at a coarse period, the quickest run there is, with stable loops (Ms 1.66).
pub fn line() -> Document {
    let axis = |name: &str| {
        format!(
            "[axes.{name}.plant.first_order]\ngain_rad_s_v = 83\ntime_constant_s = 0.2\n\
             [axes.{name}.pdff]\nkpp = 97\nkpv = 0.4\nkiv = 50\nkpf = 0.6\nkvf = 1\n"
        )
    };
    let text = format!(
        "[path.line]\nstart_mm = [0, 0]\nend_mm = [3, 4]\n[feedrate]\nfeed_mm_s = 50\n\
         [feedrate.profile.quintic]\nphase_s = 0.05\n[control]\nperiod_s = 0.002\n{}{}",
        axis("x"),
        axis("y")
    );
    Document::from_text(text, "line.toml")
}

pub fn alpha() -> Document {
    Document::builtin("alpha").unwrap()
}

pub fn plan(method: Method, samples: u64, seed: u64) -> Plan {
    Plan { method: Some(method), samples: Some(samples), seed, margins: false }
}

pub fn grid(document: &Document, vary: &[&str]) -> Sweep {
    Sweep::new(document, vary, &Plan::default()).unwrap()
}

pub fn numbers(sweep: &Sweep, index: u64) -> Vec<f64> {
    sweep.values(index).iter().map(|value| value.number().unwrap()).collect()
}

pub fn refused(vary: &[&str], plan: &Plan) -> String {
    Sweep::new(&alpha(), vary, plan).unwrap_err().to_string()
}

/// Computes a sweep into a folder and writes its tables.
pub fn computed(sweep: &Sweep, folder: &Path, block: u32) -> Exported {
    let session = Session::open(sweep, folder, Shard::WHOLE, false, Some(block)).unwrap();
    let journal = session.compute(None, &mut |_| {}).unwrap();
    export(sweep, &[journal], folder, Metric::MAX_CONTOUR_ERROR, None).unwrap()
}

/// The bytes of both tables.
pub fn tables(folder: &Path, name: &str) -> [Vec<u8>; 2] {
    ["csv", "parquet"].map(|ending| fs::read(folder.join(format!("{name}-sweep.{ending}"))).unwrap())
}
