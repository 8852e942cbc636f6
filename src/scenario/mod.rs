//! scenario
mod file;
#[cfg(test)]
mod probe {
    #[test]
    fn spans() {
        let base = "[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n[feedrate]\nfeed_mm_s=1\n[feedrate.profile.quintic]\nphase_s=1\n[axes.x.plant.first_order]\ngain_rad_s_v=1\ntime_constant_s=1\n[axes.x.pdff]\nkpp=1\nkpv=1\nkiv=1\nkpf=1\nkvf=1\n[axes.y.plant.first_order]\ngain_rad_s_v=1\ntime_constant_s=1\n[axes.y.pdff]\nkpp=1\nkpv=1\nkiv=1\nkpf=1\nkvf=1\n";
        let t = |s: String| {
            match toml::from_str::<super::file::RawScenario>(&s) {
                Ok(_) => eprintln!("ok"),
                Err(e) => eprintln!("{:?} {:?} => {:?}", e.message(), e.span(), e.span().map(|r| s.get(r).unwrap_or("?").chars().take(60).collect::<String>())),
            }
        };
        let r = |a: &str, b: &str| t(base.replacen(a, b, 1));
        t(base.into());
        r("kpp=1\n", "");
        r("kpp=1\n", "kp=1\n");
        r("kpp=1\n", "kpp='a'\n");
        r("kpp=1\n", "kpp=[1]\n");
        r("kpp=1\n", "kpp=1e400\n");
        r("kpp=1\n", "kpp=99999999999999999999999999999999999999999999999999999\n");
        r("kpp=1\n", "kpp=99999999999999999999999\n");
        r("[axes.x.pdff]\nkpp=1\nkpv=1\nkiv=1\nkpf=1\nkvf=1\n", "");
        r("[axes.x.plant.first_order]\ngain_rad_s_v=1\ntime_constant_s=1\n", "");
        r("path.line", "path.lne");
        r("[path.line]\n", "[path.circle]\nradius_mm=1\n[path.line]\n");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "path='line'\n");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "path=3\n");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "path={}\n");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "path={line=3}\n");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "path.line={start_mm=[0,0],end_mm=[0,0,1]}\n");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "path.line={start_mm=[0,0],end_mm=[0,'a']}\n");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "path.line={start_mm=[0,0],end_mm=[0]}\n");
        r("[path.line]\nstart_mm=[0,0]\nend_mm=[1,1]\n", "path.line={start_mm=[0,0]}\n");
        r("start_mm=[0,0]\nend_mm", "end_mm");
        r("[path.line]\n", "[control]\nderivative='exct'\n[path.line]\n");
        r("[path.line]\n", "[control]\nderivative=3\n[path.line]\n");
        r("[path.line]\n", "[control]\ndelay_samples=1.5\n[path.line]\n");
        r("[path.line]\n", "[limits]\ncontour_error=1.5\n[path.line]\n");
        r("[path.line]\n", "limits=3\n[path.line]\n");
        r("[path.line]\n", "limits=3 4\n[path.line]\n");
        r("[path.line]\n", "[limits\n[path.line]\n");
        r("[path.line]\n", "name=\n[path.line]\n");
        r("[path.line]\n", "name=\"abc\n[path.line]\n");
        r("[path.line]\n", "hello\n[path.line]\n");
        r("[path.line]\n", "hello world\n[path.line]\n");
        r("[path.line]\n", "name='a'\nname='b'\n[path.line]\n");
        r("[path.line]\n", "[limits]\n[limits]\n[path.line]\n");
        r("[path.line]\n", "\u{feff}[path.line]\n");
        r("[path.line]\n", "name=\"\u{1b}\"\n[path.line]\n");
        r("[path.line]\n", "\"na\\u001bme\"=1\n[path.line]\n");
        r("[path.line]\n", "[[axes]]\n[path.line]\n");
        r("[feedrate]\nfeed_mm_s=1\n[feedrate.profile.quintic]\nphase_s=1\n", "");
        r("phase_s=1\n", "");
        r("feed_mm_s=1\n", "");
        t("".into());
        t(format!("a = {}", "[".repeat(1000)));
        t(serde_json::to_string_pretty(&super::file::schema()).unwrap().chars().take(3000).collect());
        eprintln!("{}", serde_json::to_string_pretty(&super::file::schema()).unwrap().chars().take(6000).collect::<String>());
    }
}
