//! Every registered numeric key: it can be given, comes back as it was given, is refused beyond its range, and stands in the reference.

use servosim::parameters::{Presence, Scale};
use servosim::scenario::{Document, Scenario, ScenarioParameter, json_schema, scenario_parameters};
use servosim::sweep::{Plan, Sweep};

/// Values of a parameter that are likely to go with those of others: from the middle of the slider outwards.
fn usual(known: &ScenarioParameter) -> Vec<f64> {
    let slider = &known.parameter.slider;
    let at = |share: f64| match slider.scale {
        Scale::Linear => slider.low + share * (slider.high - slider.low),
        Scale::Logarithmic => slider.low * (slider.high / slider.low).powf(share),
    };
    let whole = known.parameter.range.whole;
    [0.5, 0.3, 0.1, 0.0, 0.7, 1.0].map(|share| if whole { at(share).round() } else { at(share) }).to_vec()
}

/// Alpha with the table of a key: everything in it that has to be given, and what else the key needs.
fn with_table(known: &ScenarioParameter) -> Document {
    let mut document = Document::builtin("alpha").unwrap();
    let table = |key: &str| key.rsplit_once('.').unwrap().0.to_owned();
    for other in scenario_parameters() {
        let beside = table(&other.key) == table(&known.key) && other.key != known.key;
        if beside && other.parameter.presence == Presence::Required && document.number(&other.key).is_none() {
            // The lowest usual one: a table as light as its axis can carry.
            document.set(&other.setting(other.parameter.slider.low)).unwrap();
        }
    }
    if known.key.ends_with("encoder.velocity_hz") || known.key.ends_with("encoder.velocity_damping") {
        document.set(&format!("{}.velocity=observer", table(&known.key))).unwrap();
    }
    document
}

fn with(known: &ScenarioParameter, value: f64) -> Result<Scenario, String> {
    let mut document = with_table(known);
    document.set(&known.setting(value)).map_err(|error| error.to_string())?;
    document.scenario().map_err(|error| error.to_string())
}

/// A value that the scenario takes, and the scenario with it.
fn accepted(known: &ScenarioParameter) -> (f64, Scenario) {
    let mut last = String::new();
    for value in usual(known) {
        match with(known, value) {
            Ok(scenario) => return (value, scenario),
            Err(error) => last = error,
        }
    }
    panic!("{}: no usual value is taken\n{last}", known.key);
}

/// The mechanics of a plant are not kept: gain and time constant follow from them.
fn is_kept(known: &ScenarioParameter) -> bool {
    !known.key.contains(".plant.mechanics.")
}

#[test]
fn every_key_is_read_and_comes_back() {
    assert!(scenario_parameters().len() > 100);
    for known in scenario_parameters() {
        let (value, scenario) = accepted(known);
        assert_eq!(known.get(&scenario), is_kept(known).then_some(value), "{}", known.key);
        assert_eq!(ScenarioParameter::find(&known.key).unwrap().key, known.key);
    }
}

#[test]
fn an_axis_gives_what_was_set() {
    for known in scenario_parameters() {
        let (Some(axis), Some(parameter)) = (known.axis(), known.of_axis()) else { continue };
        let (_, scenario) = accepted(known);
        let (mut parameters, mut drive) = (scenario.axes[axis], scenario.drives[axis].clone());
        let value = if known.parameter.range.whole { 3.0 } else { 0.123456789 };
        assert_eq!(parameter.set(&mut parameters, &mut drive, value), is_kept(known), "{}", known.key);
        assert_eq!(parameter.get(&parameters, &drive), is_kept(known).then_some(value), "{}", known.key);
        // The other axes of the same scenario have kept theirs.
        assert_eq!(parameter.get(&scenario.axes[axis], &scenario.drives[axis]), known.get(&scenario), "{}", known.key);
        // A value of the model is one of the batch's lanes too; one of the drive is not.
        let mut model = scenario.axes[axis];
        let in_model = parameter.set_in_model(&mut model, value);
        assert_eq!(in_model, parameter.is_of_model(), "{}", known.key);
        assert_eq!(model == scenario.axes[axis], !in_model, "{}", known.key);
    }
}

#[test]
fn a_value_just_outside_its_range_is_refused_in_the_words_of_the_registry() {
    for known in scenario_parameters() {
        let name = known.parameter.name();
        for value in known.parameter.just_outside() {
            let error = known.parameter.check(value).unwrap_err();
            let shown = with(known, value).expect_err(&known.key);
            // (In a diagnostic a number of more than 20 digits has an exponent.)
            assert!(shown.contains(&error.message(name)), "{} = {value}\n{shown}\n{}", known.key, error.message(name));
            assert!(shown.contains(&format!("\n1 | {name} = ")) || shown.contains(&format!("{name} = ")), "{shown}");
            assert!(shown.contains('^'), "{shown}");
        }
        for value in [f64::NAN, f64::INFINITY] {
            assert!(known.parameter.check(value).is_err(), "{} = {value}", known.key);
        }
        for value in usual(known) {
            assert!(known.parameter.check(value).is_ok(), "{}: {value} of the slider is out of range", known.key);
        }
        if let Presence::Default(value) = known.parameter.presence {
            assert!(known.parameter.check(value).is_ok(), "{}: the default is out of range", known.key);
        }
    }
}

#[test]
fn defaults_are_those_of_a_scenario_that_gives_none() {
    for known in scenario_parameters() {
        let Presence::Default(default) = known.parameter.presence else { continue };
        let mut document = with_table(known);
        // The table may have to be there: any other key of it that has a default.
        let table = known.key.rsplit_once('.').unwrap().0;
        let beside = scenario_parameters().iter().find(|other| {
            other.key != known.key
                && other.key.rsplit_once('.').unwrap().0 == table
                && matches!(other.parameter.presence, Presence::Default(_))
        });
        if let Some(Presence::Default(value)) = beside.map(|other| other.parameter.presence) {
            document.set(&beside.unwrap().setting(value)).unwrap();
        }
        let text = document.text().lines().filter(|line| !line.starts_with(&format!("{} =", known.parameter.name())));
        let text = text.collect::<Vec<_>>().join("\n");
        let Ok(scenario) = Scenario::from_toml(&text, "alpha.toml") else { continue };
        if let Some(value) = known.get(&scenario) {
            assert_eq!(value, default, "{}", known.key);
        }
    }
}

#[test]
fn every_key_can_be_swept() {
    for known in scenario_parameters() {
        let (value, _) = accepted(known);
        let mut document = with_table(known);
        document.set(&known.setting(value)).unwrap();
        let vary = [format!("{}={value:e}", known.key)];
        let sweep =
            Sweep::new(&document, &vary, &Plan::default()).unwrap_or_else(|error| panic!("{}: {error}", known.key));
        assert_eq!(sweep.why_invalid(0), None, "{} = {value}", known.key);
    }
}

#[test]
fn regression_gains_that_follow_from_those_of_pdff_follow_in_a_sweep() {
    let mut document = Document::builtin("alpha").unwrap();
    document.set("axes.x.controller.p_pi.integral_1_s=200").unwrap();
    for key in ["axes.x.pdff.kpp", "axes.x.plant.first_order.gain_rad_s_v"] {
        let sweep = Sweep::new(&document, &[format!("{key}=60,90")], &Plan::default()).unwrap();
        let rows = sweep.evaluate(0..2, None).unwrap();
        for (place, value) in ["60", "90"].into_iter().enumerate() {
            let mut alone = document.clone();
            alone.set(&format!("{key}={value}")).unwrap();
            let summary = alone.scenario().unwrap().run(&mut []).unwrap();
            assert_eq!(rows.metric(place, "max_contour_error_um"), summary.max_contour_error_um, "{key} = {value}");
        }
    }
}

/// The schema's node of a key.
fn find<'a>(node: &'a serde_json::Value, path: &[&str]) -> Option<&'a serde_json::Value> {
    let Some((first, rest)) = path.split_first() else { return Some(node) };
    if let Some(next) = node.get("properties").and_then(|keys| keys.get(first)) {
        return find(next, rest);
    }
    let choices = ["oneOf", "anyOf"].into_iter().filter_map(|key| node.get(key)?.as_array()).flatten();
    choices.into_iter().find_map(|choice| find(choice, path))
}

#[test]
fn the_schema_describes_every_key() {
    let schema = json_schema();
    for known in scenario_parameters() {
        let path: Vec<&str> = known.key.split('.').collect();
        let node = find(&schema, &path).unwrap_or_else(|| panic!("{}", known.key));
        assert_eq!(node["description"], known.parameter.description(), "{}", known.key);
        let ends = ["minimum", "exclusiveMinimum"].map(|end| node.get(end).and_then(serde_json::Value::as_f64));
        let low = known.parameter.range.low;
        let expected = if low.is_open() { [None, Some(low.value())] } else { [Some(low.value()), None] };
        assert_eq!(ends, expected, "{}", known.key);
    }
}

/// The rows of the reference: keys of the axes once, for X.
fn rows() -> String {
    let row = |known: &ScenarioParameter| {
        let parameter = known.parameter;
        let default = parameter.default_text().unwrap_or_else(|| "required".to_owned());
        let (key, unit, range, help) = (&known.key, parameter.unit, parameter.range.interval(), parameter.help);
        let whole = if parameter.range.whole { ", whole" } else { "" };
        format!("| `{key}` | {unit} | {range}{whole} | {default} | {help} |\n")
    };
    let head = "| key | unit | range | default | meaning |\n|---|---|---|---|---|\n";
    let of_x = scenario_parameters().iter().filter(|known| known.axis() != Some(1));
    std::iter::once(head.to_owned()).chain(of_x.map(row)).collect()
}

#[test]
fn the_reference_lists_every_key() {
    const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/scenario.md");
    const HEAD: &str = "| key | unit | range | default | meaning |\n";
    let page = std::fs::read_to_string(PAGE).unwrap();
    let start = page.find(HEAD).expect("the page has the table of numeric keys");
    let length: usize =
        page[start..].split_inclusive('\n').take_while(|line| line.starts_with('|')).map(str::len).sum();
    if std::env::var_os("SERVOSIM_WRITE_REFERENCE").is_some() {
        std::fs::write(PAGE, format!("{}{}{}", &page[..start], rows(), &page[start + length..])).unwrap();
        return;
    }
    let table = &page[start..start + length];
    assert!(
        table == rows(),
        "docs/reference/scenario.md is not what the parameters say: SERVOSIM_WRITE_REFERENCE=1 cargo test --test files \
         the_reference_lists writes\n{}",
        rows()
    );
}
