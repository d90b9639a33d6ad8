//! "Did you mean": the known name that looks most like an unknown one.

/// The candidate nearest to the name, if one is near enough to be a slip: at most one edit in three
/// characters of the longer of the two, capitals aside. Of equally near candidates the first is
/// taken.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    let length = name.chars().count();
    candidates
        .into_iter()
        .filter(|candidate| *candidate != name)
        .map(|candidate| (distance(name, &lower, candidate), candidate))
        .filter(|(distance, candidate)| distance.0 <= length.max(candidate.chars().count()) / 3)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Edits without regard to capitals, then with.
fn distance(name: &str, lower: &str, candidate: &str) -> (usize, usize) {
    let aside = strsim::osa_distance(lower, &candidate.to_lowercase());
    (aside, strsim::osa_distance(name, candidate))
}
