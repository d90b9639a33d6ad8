//! What can be claimed about a trace: a closed list, as a file writes it.

use super::steps::Moment;
use crate::fields::{Fields, Written};
use crate::files::FileError;

/// What a claim is about, by the key that names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// Every value of a column.
    Every,
    /// The greatest value of a column.
    Greatest,
    /// The least value of a column.
    Least,
    /// The mean of a column.
    Mean,
    /// How often an event comes.
    Count,
    /// Every argument of an event: `note.speed`.
    Argument,
    /// How often a column rises above `over` (and falls below `under` between).
    Peaks,
    /// The greatest distance of two columns.
    Apart,
    /// How much a column falls while it should only rise.
    Rises,
    /// How much a column rises while it should only fall.
    Falls,
    /// How much later the last of two instants is than the first: a time.
    Duration,
    /// Events that come one after the other.
    Order,
}

/// The keys of the subjects, and what each names.
pub const SUBJECTS: [(&str, Subject, &str); 12] = [
    ("every", Subject::Every, "force"),
    ("greatest", Subject::Greatest, "force"),
    ("least", Subject::Least, "force"),
    ("mean", Subject::Mean, "force"),
    ("count", Subject::Count, "note"),
    ("argument", Subject::Argument, "note.speed"),
    ("peaks", Subject::Peaks, "force"),
    ("apart", Subject::Apart, "force"),
    ("rises", Subject::Rises, "force"),
    ("falls", Subject::Falls, "force"),
    ("duration", Subject::Duration, "t1"),
    ("order", Subject::Order, "note"),
];

/// The keys of a claim besides its subject.
const OTHERS: [&str; 9] = [
    "is", "within", "at_least", "at_most", "from", "until", "over", "under", "why",
];

/// All keys of a claim.
pub fn known() -> Vec<&'static str> {
    SUBJECTS.iter().map(|s| s.0).chain(OTHERS).collect()
}

/// A claim as it was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    pub subject: Subject,
    /// The key of the subject.
    pub key: &'static str,
    /// What it names: columns, events, instants.
    pub names: Vec<Written>,
    pub is: Option<Written>,
    pub within: Option<Written>,
    pub at_least: Option<Written>,
    pub at_most: Option<Written>,
    pub over: Option<Written>,
    pub under: Option<Written>,
    pub from: Option<Moment>,
    pub until: Option<Moment>,
    pub why: Option<String>,
    pub line: u64,
}

impl Claim {
    /// Reads one; `instants` are the names of the instants.
    pub fn read(fields: &Fields, instants: &[String]) -> Result<Claim, FileError> {
        let mut given = SUBJECTS.iter().filter(|subject| fields.has(subject.0));
        let (key, subject) = match (given.next(), given.next()) {
            (Some((key, subject, _)), None) => (*key, *subject),
            (None, _) => {
                let all: Vec<&str> = SUBJECTS.iter().map(|s| s.0).collect();
                let what = format!(
                    "[[assert]] says what it is about: one of {}",
                    all.join(", ")
                );
                return Err(fields.source.error(fields.line, what));
            }
            (Some((first, ..)), Some((second, ..))) => {
                let what = format!("and `{first}` are two assertions; write [[assert]] for each");
                return Err(fields.error(second, &what));
            }
        };
        let moment = |key: &str| {
            let written = fields.find(key)?;
            let read = |written: Written| {
                Moment::read(&written.text, instants)
                    .map_err(|why| fields.source.error(written.line, why))
            };
            written.map(read).transpose()
        };
        let claim = Claim {
            subject,
            key,
            names: fields.list(key)?,
            is: fields.find("is")?,
            within: fields.find("within")?,
            at_least: fields.find("at_least")?,
            at_most: fields.find("at_most")?,
            over: fields.find("over")?,
            under: fields.find("under")?,
            from: moment("from")?,
            until: moment("until")?,
            why: fields.find("why")?.map(|written| written.text),
            line: fields.line,
        };
        claim.makes_sense(fields)?;
        Ok(claim)
    }

    fn makes_sense(&self, fields: &Fields) -> Result<(), FileError> {
        let wanted = match self.subject {
            Subject::Apart | Subject::Duration => 2..=2,
            Subject::Order => 2..=100,
            _ => 1..=1,
        };
        if !wanted.contains(&self.names.len()) {
            let many = if *wanted.start() == 1 {
                "one name"
            } else {
                "two names"
            };
            let more = if *wanted.end() == 100 { " or more" } else { "" };
            return Err(fields.error(self.key, &format!("takes {many}{more}")));
        }
        let bounds = ["is", "at_least", "at_most"]
            .into_iter()
            .find(|key| fields.has(key));
        if self.subject == Subject::Order {
            let extra = ["is", "within", "at_least", "at_most", "over", "under"];
            return match extra.into_iter().find(|key| fields.has(key)) {
                Some(key) => Err(fields.error(key, "does not belong to `order`")),
                None => Ok(()),
            };
        }
        if bounds.is_none() {
            let what = format!(
                "`{}` needs a bound: `is`, `at_least` or `at_most`",
                self.key
            );
            return Err(fields.source.error(self.line, what));
        }
        if self.is.is_some() && (self.at_least.is_some() || self.at_most.is_some()) {
            return Err(fields.error("is", "and a bound contradict each other: leave one away"));
        }
        if self.within.is_some() && self.is.is_none() {
            return Err(fields.error("within", "belongs to `is`"));
        }
        match (self.subject == Subject::Peaks, self.over.is_some()) {
            (true, false) => Err(fields
                .source
                .error(self.line, "`peaks` needs `over`: what a peak rises above")),
            (false, true) => Err(fields.error("over", "belongs to `peaks`")),
            (false, false) if self.under.is_some() => {
                Err(fields.error("under", "belongs to `peaks`"))
            }
            _ => self.window_makes_sense(fields),
        }
    }

    fn window_makes_sense(&self, fields: &Fields) -> Result<(), FileError> {
        let (Some(from), Some(until)) = (&self.from, &self.until) else {
            return Ok(());
        };
        let is_backward = match (from.named, until.named) {
            (Some(first), Some(last)) if first != last => first > last,
            (first, last) if first == last => from.offset_s >= until.offset_s,
            _ => false,
        };
        if is_backward {
            let what = format!("is `{}`, which is not after `{}`", until.text, from.text);
            return Err(fields.error("until", &what));
        }
        Ok(())
    }

    /// The claim as a sentence, without the bounds.
    pub fn told(&self) -> String {
        let names: Vec<&str> = self.names.iter().map(|name| name.text.as_str()).collect();
        let text = |written: &Option<Written>, word: &str| {
            written
                .as_ref()
                .map_or(String::new(), |w| format!(" {word} {}", w.text))
        };
        let window = |moment: &Option<Moment>, word: &str| {
            moment
                .as_ref()
                .map_or(String::new(), |m| format!(" {word} {}", m.text))
        };
        format!(
            "{} {}{}{}{}{}{}{}{}{}",
            self.key,
            names.join(if self.subject == Subject::Order {
                ", then "
            } else {
                " and "
            }),
            text(&self.over, "over"),
            text(&self.under, "under"),
            text(&self.is, "is"),
            text(&self.within, "within"),
            text(&self.at_least, "at least"),
            text(&self.at_most, "at most"),
            window(&self.from, "from"),
            window(&self.until, "until"),
        )
    }
}
