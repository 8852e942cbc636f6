//! Results of a suite as JUnit XML, the form that CI servers read.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, Event};

use super::CliError;
use super::output::printable;
use super::test::{Tested, Verdict, held};

/// What is wrong with a test case: the element, its type and its message.
type Problem = Option<(&'static str, &'static str, String)>;

/// The document: a suite a scenario, a case a limit and one for lock-up; a scenario that cannot be used is an error. No times
/// are in it: the same scenarios give the same bytes.
pub(super) fn document(results: &[Tested]) -> Result<Vec<u8>, CliError> {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
    write(&mut writer, results).map_err(CliError::Junit)?;
    let mut bytes = writer.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

fn write(writer: &mut Writer<Vec<u8>>, results: &[Tested]) -> io::Result<()> {
    let suites: Vec<(&Tested, Vec<(String, Problem)>)> = results.iter().map(|result| (result, cases(result))).collect();
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let all: Vec<&[(String, Problem)]> = suites.iter().map(|(_, cases)| cases.as_slice()).collect();
    writer.write_event(Event::Start(counted("testsuites", "servosim", &all)))?;
    for (result, cases) in &suites {
        let suite = text(&result.scenario);
        writer.write_event(Event::Start(counted("testsuite", &suite, &[cases])))?;
        for (name, problem) in cases {
            let mut case = BytesStart::new("testcase");
            case.push_attribute(("classname", suite.as_str()));
            case.push_attribute(("name", text(name).as_str()));
            let Some((element, kind, message)) = problem else {
                writer.write_event(Event::Empty(case))?;
                continue;
            };
            writer.write_event(Event::Start(case))?;
            let mut told = BytesStart::new(*element);
            told.push_attribute(("type", *kind));
            told.push_attribute(("message", text(message).as_str()));
            writer.write_event(Event::Empty(told))?;
            writer.write_event(Event::End(BytesEnd::new("testcase")))?;
        }
        writer.write_event(Event::End(BytesEnd::new("testsuite")))?;
    }
    writer.write_event(Event::End(BytesEnd::new("testsuites")))
}

fn cases(result: &Tested) -> Vec<(String, Problem)> {
    if let Some(error) = &result.error {
        let kind = if result.verdict == Verdict::Unusable { "scenario" } else { "run" };
        return vec![(kind.to_owned(), Some(("error", kind, error.clone())))];
    }
    let mut cases: Vec<(String, Problem)> = Vec::new();
    for check in &result.limits {
        let problem = (!check.kept).then(|| ("failure", "limit", held(check)));
        cases.push((check.name.clone(), problem));
    }
    let lockup = result.lockup.clone().map(|lockup| ("failure", "lock-up", lockup));
    cases.push(("lock-up".to_owned(), lockup));
    cases
}

fn counted(element: &'static str, name: &str, suites: &[&[(String, Problem)]]) -> BytesStart<'static> {
    let cases = || suites.iter().flat_map(|cases| cases.iter());
    let count = |wanted: &str| {
        cases().filter(|(_, problem)| problem.as_ref().is_some_and(|(element, ..)| *element == wanted)).count()
    };
    let mut start = BytesStart::new(element);
    start.push_attribute(("name", name));
    start.push_attribute(("tests", cases().count().to_string().as_str()));
    start.push_attribute(("failures", count("failure").to_string().as_str()));
    start.push_attribute(("errors", count("error").to_string().as_str()));
    start
}

/// Without what XML forbids, and in one line: an attribute keeps no line breaks.
fn text(text: &str) -> String {
    printable(text).chars().map(|c| if matches!(c, '\n' | '\u{fffe}' | '\u{ffff}') { ' ' } else { c }).collect()
}
