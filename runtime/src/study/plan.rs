//! Reading of a study's plan: who plays what, what is asked, in TOML.

use std::path::Path;

use toml::de::DeTable;

use crate::fields::{Fields, FileText, seconds};
use crate::files::FileError;

/// What stands where a plan leaves a wording to whoever runs the study.
const OPEN: &str = "?";

/// A study.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Heading.
    pub title: String,
    /// Where it comes from; may be empty.
    pub source: String,
    /// What participants read first; may be empty.
    pub doc: String,
    /// What is played, in the order of the text.
    pub conditions: Vec<Condition>,
    /// What is done in each condition.
    pub tasks: Vec<StudyTask>,
    /// What is asked after each condition.
    pub items: Vec<Item>,
    /// The words at the two ends of the scale.
    pub ends: [String; 2],
    /// Points of the scale.
    pub points: usize,
    /// The question which condition is preferred; none where it is not asked.
    pub preferred: Option<String>,
    /// The question that is answered freely.
    pub comment: Option<String>,
}

/// What is played.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Short, for tables.
    pub name: String,
    /// What participants read.
    pub title: String,
    /// A bundled program by name, or a file ending in `.whip`.
    pub program: String,
    /// A preset, by name or file.
    pub preset: Option<String>,
    /// Parameters and their values.
    pub sets: Vec<(String, String)>,
    /// Live values that participants may turn.
    pub knobs: Vec<String>,
    /// Where it stands.
    pub line: u64,
}

/// What is done.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyTask {
    /// Short, for tables.
    pub name: String,
    /// What participants read.
    pub text: String,
    /// When it ends by itself (s).
    pub lasts_s: f64,
    /// What is to be played, if anything is marked.
    pub target: Option<Target>,
}

/// What is to be played: an event whose argument says what was.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// The event.
    pub event: String,
    /// Its argument.
    pub argument: String,
    /// Targets are 0 up to this number.
    pub of: usize,
    /// How many are to be met.
    pub repeats: usize,
}

/// A statement that is rated.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Short, for tables.
    pub name: String,
    /// What participants read.
    pub text: String,
}

const TOP: [&str; 9] = [
    "title",
    "source",
    "doc",
    "scale",
    "condition",
    "task",
    "item",
    "preferred",
    "comment",
];
const CONDITION: [&str; 6] = ["name", "title", "program", "preset", "set", "knobs"];
const TASK: [&str; 7] = [
    "name", "text", "lasts", "event", "argument", "of", "repeats",
];
/// The longest task (s): as long as a gesture is kept.
const LASTS_MAX_S: f64 = 1800.0;

impl Plan {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// What is wrong with it, and in which line; a wording that is left open.
    pub fn read(path: &Path, text: &str) -> Result<Plan, FileError> {
        let source = FileText { path, text };
        let table = DeTable::parse(text).map_err(|e| {
            let line = e.span().map_or(1, |span| source.line(span.start));
            source.error(line, e.message())
        })?;
        let top = Fields::new(source, table.get_ref(), 1, "a study", &TOP)?;
        let optional = |key| Ok::<_, FileError>(top.find(key)?.map(|written| written.text));
        let conditions = top.tables("condition", "[[condition]]", &CONDITION)?;
        let tasks = top.tables("task", "[[task]]", &TASK)?;
        let items = top.tables("item", "[[item]]", &["name", "text"])?;
        let scale = top.table("scale", "[scale]", &["points", "low", "high"])?;
        let end = |key: &str, usual: &str| match &scale {
            Some(scale) => scale.text(key, usual).map(|written| written.text),
            None => Ok(usual.to_string()),
        };
        let points = scale.as_ref().map_or(Ok(None), |of| of.count("points"))?;
        let points = points.unwrap_or(7);
        if !(2..=11).contains(&points) {
            return Err(source.error(1, "`points` of [scale] is from 2 to 11"));
        }
        let plan = Plan {
            title: top.text("title", "Rubbing with three devices")?.text,
            source: optional("source")?.unwrap_or_default(),
            doc: optional("doc")?.unwrap_or_default().trim().to_string(),
            ends: [
                end("low", "Strongly Disagree")?,
                end("high", "Strongly Agree")?,
            ],
            points,
            preferred: optional("preferred")?,
            comment: optional("comment")?,
            conditions: conditions.iter().map(condition).collect::<Result<_, _>>()?,
            tasks: tasks.iter().map(task).collect::<Result<_, _>>()?,
            items: items.iter().map(item).collect::<Result<_, _>>()?,
        };
        plan.is_whole(source)?;
        Ok(plan)
    }

    /// That there is something to compare, under names of their own.
    fn is_whole(&self, source: FileText) -> Result<(), FileError> {
        if self.conditions.len() < 2 {
            return Err(source.error(1, "a study compares two [[condition]] tables or more"));
        }
        if self.tasks.is_empty() {
            return Err(source.error(1, "a study has a [[task]] table or more"));
        }
        let conditions = self.conditions.iter().map(|one| one.name.as_str());
        let tasks = self.tasks.iter().map(|one| one.name.as_str());
        let items = self.items.iter().map(|one| one.name.as_str());
        for names in [
            conditions.collect::<Vec<_>>(),
            tasks.chain(items).collect::<Vec<_>>(),
        ] {
            let twice = (names.iter().enumerate()).find(|(at, name)| names[..*at].contains(name));
            if let Some((_, name)) = twice {
                return Err(source.error(1, format!("`{name}` is the name of two tables")));
            }
        }
        Ok(())
    }
}

/// A text that whoever runs the study has filled in.
fn filled(fields: &Fields, key: &'static str, example: &str) -> Result<String, FileError> {
    let written = fields.text(key, example)?;
    match written.text.trim() {
        OPEN | "" => Err(fields.error(
            key,
            "is left open: write it, nobody has published its wording",
        )),
        _ => Ok(written.text),
    }
}

fn condition(fields: &Fields) -> Result<Condition, FileError> {
    let name = filled(fields, "name", "mouse")?;
    let sets = fields.pairs("set", "set = { NAME = \"VALUE\" }")?;
    let knobs = fields.list("knobs")?.into_iter();
    Ok(Condition {
        title: fields.find("title")?.map_or(name.clone(), |w| w.text),
        name,
        program: filled(fields, "program", "rubbed-mouse")?,
        preset: fields.find("preset")?.map(|written| written.text),
        sets: sets.into_iter().map(|(name, w)| (name, w.text)).collect(),
        knobs: knobs.map(|written| written.text).collect(),
        line: fields.line,
    })
}

fn task(fields: &Fields) -> Result<StudyTask, FileError> {
    let lasts = fields.text("lasts", "60 s")?;
    let lasts_s = seconds(&lasts.text).map_err(|why| fields.source.error(lasts.line, why))?;
    if !(lasts_s > 0.0 && lasts_s <= LASTS_MAX_S) {
        return Err(fields.error("lasts", "is more than 0 s and at most 1800 s"));
    }
    let event = fields.find("event")?;
    let target = match event {
        None => {
            let stray = ["argument", "of", "repeats"].into_iter();
            if let Some(key) = stray.into_iter().find(|key| fields.has(key)) {
                return Err(fields.error(key, "belongs to a task with an `event`"));
            }
            None
        }
        Some(event) => Some(Target {
            event: event.text,
            argument: fields.text("argument", "member")?.text,
            of: fields.count("of")?.unwrap_or(1),
            repeats: fields.count("repeats")?.unwrap_or(1),
        }),
    };
    Ok(StudyTask {
        name: filled(fields, "name", "explore")?,
        text: filled(fields, "text", "Play as you like.")?,
        lasts_s,
        target,
    })
}

fn item(fields: &Fields) -> Result<Item, FileError> {
    Ok(Item {
        name: filled(fields, "name", "realism")?,
        text: filled(fields, "text", "The interaction was realistic.")?,
    })
}

#[cfg(test)]
mod tests {
    use super::Plan;
    use std::path::Path;

    const WHOLE: &str = "title = \"t\"\n[[condition]]\nname = \"a\"\nprogram = \"keytar\"\n\
        [[condition]]\nname = \"b\"\nprogram = \"keytar\"\n[[task]]\nname = \"t\"\ntext = \"play\"\n\
        lasts = \"5 s\"\n[[item]]\nname = \"i\"\ntext = \"it was\"\n";

    #[test]
    fn mistakes_are_told_with_their_lines() {
        let read = |text: &str| Plan::read(Path::new("p.toml"), text);
        assert!(read(WHOLE).is_ok());
        for (right, wrong, says) in [
            (
                "program = \"keytar\"",
                "progam = \"keytar\"",
                "did you mean `program`",
            ),
            ("\"it was\"", "\"?\"", "is left open"),
            ("\"5 s\"", "\"5 mm\"", "5 mm"),
            ("name = \"b\"", "name = \"a\"", "the name of two"),
            ("title = \"t\"", "titel = \"t\"", "did you mean `title`"),
            (
                "lasts",
                "repeats = 3\nlasts",
                "belongs to a task with an `event`",
            ),
        ] {
            let error = read(&WHOLE.replacen(right, wrong, 1)).expect_err(says);
            assert!(error.to_string().contains(says), "{error}");
        }
    }
}
