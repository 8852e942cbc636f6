use servosim::scenario::*;
#[test]
fn zz() {
    for n in ["alpha", "heart", "star"] {
        match Scenario::built_in(n) {
            Ok(s) => {
                let r = s.run(&mut []).unwrap();
                eprintln!(
                    "{n} {} {} k={} lim={:?}",
                    r.path_length_mm, r.max_contour_error_um, r.max_curvature_1_mm, r.limits
                )
            }
            Err(e) => eprintln!("{e}"),
        }
    }
    let alpha = Document::built_in("alpha").unwrap().text().to_owned();
    let t = |a: &str, b: &str| {
        assert!(alpha.contains(a), "{a}");
        match Scenario::from_toml(&alpha.replacen(a, b, 1), "dir/al.toml") {
            Ok(s) => eprintln!("OK {s:?}"),
            Err(e) => eprintln!("{e}\n"),
        }
    };
    t("kpp = 97.38\n", "");
    t("kpp = 97.38", "kp = 97.38");
    t("kpp = 97.38", "kpp = nan");
    t("kpv = 1.19", "kpv = -3");
    t("voltage_limit_v = 5", "voltage_limit_v = 0\n[limits]\nvoltage_v=-2\n[axes.z]");
    t("voltage_limit_v = 5", "voltage_limit_v = 0\n[feedrat]\n");
    t("kpp = 97.38", "kpp = '97'");
    t("feed_mm_s = 100", "feed_mm_s = 1e400");
    t("feed_mm_s = 100", "feed_mm_s = 100\nphase_s = 3");
    t("[axes.x.pdff]", "[axes.x.pdf]");
    t("[feedrate.profile.exponential]", "[feedrate.profile.exponental]");
    t("[path.ph_spline]", "[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n[path.ph_spline]");
    t("[path.ph_spline]", "[path]\n[paths.ph_spline]");
    t("[12, 18]", "[12, 18, 3]");
    t("[12, 18]", "[12, inf]");
    t("[12, 18]", "[0, 0]");
    t("[12, 18]", "[0, 0],[0,0],[0,0]");
    t("[12, 18], [24, 27], [36, 9], [24, -9], ", "");
    t("control_points_mm", "nodal_points_mm");
    t("control_points_mm", "end_tangents=[[1,1]]\nnodal_points_mm");
    t("period_s = 0.001", "period_s =");
    t("period_s = 0.001", "period_s = 1ms");
    t("period_s = 0.001", "period_s = 1e-9");
    t("derivative = \"backward\"", "derivative = \"backwards\"");
    t("[control]", "[[control]]");
    t("[axes.y.pdff]", "[axes.y.pid]");
    t("[limits]", "[limits");
    t("[limits]", "name = \"a\u{1b}[31m\"\n[limits]");
    t("closed = false", "closed = \"no\"");
    t("control_points_mm = [[0, 0], [12, 18], [24, 27], [36, 9], [24, -9], [12, 0], [0, 18]]", "");
    t("n_c = 8.12", "n_c = \"best\"");
    t("n_c = 8.12", "n_c = 19");
    let mut d = Document::built_in("alpha").unwrap();
    d.set("axes.x.pdff.kpp=-1").unwrap();
    d.set("feedrate.profile.quintic.phase_s=0.1").unwrap();
    d.set("limits.voltage_v=5").unwrap();
    eprintln!("{}", d.scenario().unwrap_err());
    d.set("axes.x.pdff.kpp=120").unwrap();
    d.set("name=foo").unwrap();
    eprintln!("{:?}\n{}", d.scenario(), d.text());
    let mut d = Document::built_in("alpha").unwrap();
    d.set("feedrate.profile.jerk_limited.accel_mm_s2=2000").unwrap();
    eprintln!("{}", d.scenario().unwrap_err());
    let mut d = Document::built_in("alpha").unwrap();
    d.set("axes.x.pdff.kp=2000").unwrap();
    eprintln!("{}", d.scenario().unwrap_err());
    let mut d = Document::built_in("alpha").unwrap();
    d.set("axes.x.pdff=2000").unwrap();
    eprintln!("{}", d.scenario().unwrap_err());
    eprintln!("{}", d.set("axes.x.pdff.kpp=2").unwrap_err());
    eprintln!("{}", Document::find("alpa").unwrap_err());
    eprintln!("{}", Document::find("src").unwrap_err());
}
