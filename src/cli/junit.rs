//! Results of a suite as JUnit XML, the form that CI servers read.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, Event};

use super::CliError;
use super::output::printable;
use super::tested::{Tested, Verdict, held};

/// What is wrong with a test case: the element, its type and its message.
struct Problem {
    element: &'static str,
    kind: &'static str,
    message: String,
}

/// A test case: a limit, or the lock-up.
struct Case {
    name: String,
    problem: Option<Problem>,
    /// Value and limit, as properties.
    values: Option<[f64; 2]>,
    seconds: f64,
}

/// The document: a suite a scenario, a case a limit and one for lock-up; a scenario that cannot be used is an error, one without limits is
/// skipped. The time of a scenario stands at its suite and is shared by its cases; but for times the same scenarios give the same bytes.
pub(super) fn document(results: &[Tested]) -> Result<Vec<u8>, CliError> {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
    write(&mut writer, results).map_err(CliError::Junit)?;
    let mut bytes = writer.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

fn write(writer: &mut Writer<Vec<u8>>, results: &[Tested]) -> io::Result<()> {
    let suites: Vec<(&Tested, Vec<Case>)> = results.iter().map(|result| (result, cases(result))).collect();
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let all: Vec<&[Case]> = suites.iter().map(|(_, cases)| cases.as_slice()).collect();
    writer.write_event(Event::Start(counted("testsuites", "servosim", &all)))?;
    for (result, cases) in &suites {
        let suite = text(&result.scenario);
        writer.write_event(Event::Start(counted("testsuite", &suite, &[cases])))?;
        for case in cases {
            write_case(writer, &suite, case)?;
        }
        writer.write_event(Event::End(BytesEnd::new("testsuite")))?;
    }
    writer.write_event(Event::End(BytesEnd::new("testsuites")))
}

fn write_case(writer: &mut Writer<Vec<u8>>, suite: &str, case: &Case) -> io::Result<()> {
    let mut start = BytesStart::new("testcase");
    start.push_attribute(("classname", suite));
    start.push_attribute(("name", text(&case.name).as_str()));
    start.push_attribute(("time", seconds(case.seconds).as_str()));
    if case.problem.is_none() && case.values.is_none() {
        return writer.write_event(Event::Empty(start));
    }
    writer.write_event(Event::Start(start))?;
    if let Some(values) = case.values {
        writer.write_event(Event::Start(BytesStart::new("properties")))?;
        for (name, value) in ["value", "limit"].into_iter().zip(values) {
            let mut property = BytesStart::new("property");
            property.push_attribute(("name", name));
            property.push_attribute(("value", value.to_string().as_str()));
            writer.write_event(Event::Empty(property))?;
        }
        writer.write_event(Event::End(BytesEnd::new("properties")))?;
    }
    if let Some(Problem { element, kind, message }) = &case.problem {
        let mut told = BytesStart::new(*element);
        if !kind.is_empty() {
            told.push_attribute(("type", *kind));
        }
        told.push_attribute(("message", text(message).as_str()));
        writer.write_event(Event::Empty(told))?;
    }
    writer.write_event(Event::End(BytesEnd::new("testcase")))
}

fn cases(result: &Tested) -> Vec<Case> {
    let problem = |element, kind, message: String| Some(Problem { element, kind, message });
    let case = |name: &str, problem, values| Case { name: name.to_owned(), problem, values, seconds: 0.0 };
    let mut cases: Vec<Case> = Vec::new();
    if let Some(error) = &result.error {
        let kind = if result.verdict == Verdict::Unusable { "scenario" } else { "run" };
        cases.push(case(kind, problem("error", kind, error.clone()), None));
    } else {
        for check in &result.limits {
            let broken = if check.kept { None } else { problem("failure", "limit", held(check)) };
            cases.push(case(&check.name, broken, Some([check.value, check.limit])));
        }
        if result.limits.is_empty() {
            cases.push(case("limits", problem("skipped", "", "the scenario has no limits".to_owned()), None));
        }
        let lockup = result.lockup.clone().and_then(|lockup| problem("failure", "lock-up", lockup));
        cases.push(case("lock-up", lockup, None));
    }
    let share = result.seconds / cases.len().max(1) as f64;
    for case in &mut cases {
        case.seconds = share;
    }
    cases
}

fn counted(element: &'static str, name: &str, suites: &[&[Case]]) -> BytesStart<'static> {
    let cases = || suites.iter().flat_map(|cases| cases.iter());
    let count = |wanted: &str| {
        cases().filter(|case| case.problem.as_ref().is_some_and(|problem| problem.element == wanted)).count()
    };
    let mut start = BytesStart::new(element);
    start.push_attribute(("name", name));
    start.push_attribute(("tests", cases().count().to_string().as_str()));
    start.push_attribute(("failures", count("failure").to_string().as_str()));
    start.push_attribute(("errors", count("error").to_string().as_str()));
    start.push_attribute(("skipped", count("skipped").to_string().as_str()));
    start.push_attribute(("time", seconds(cases().map(|case| case.seconds).sum()).as_str()));
    start
}

/// Seconds to the microsecond, as JUnit has them.
fn seconds(seconds: f64) -> String {
    format!("{seconds:.6}")
}

/// Without what XML forbids, and in one line: an attribute keeps no line breaks.
fn text(text: &str) -> String {
    printable(text).chars().map(|c| if matches!(c, '\n' | '\u{fffe}' | '\u{ffff}') { ' ' } else { c }).collect()
}
