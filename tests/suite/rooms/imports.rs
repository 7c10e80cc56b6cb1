//! What the files of a room use of each other.

use std::collections::{BTreeMap, BTreeSet};

use super::source::Source;

/// Which files a file uses, by their places in the list, and of whose items.
pub(super) struct Imports {
    /// For each file the others of its room that it uses.
    pub(super) used: Vec<BTreeSet<usize>>,
    /// Files that use an item that the module above them declares, and which.
    pub(super) of_parents: BTreeSet<(usize, String)>,
}

/// A file's names.
struct Names<'a> {
    /// Modules that it declares.
    children: BTreeSet<&'a str>,
    /// What its `use` lines bring into scope: name and path.
    imports: Vec<(&'a str, Vec<&'a str>)>,
    /// All other paths in it.
    paths: Vec<Vec<&'a str>>,
}

impl Imports {
    pub(super) fn of(sources: &[Source]) -> Self {
        let places: BTreeMap<&str, usize> =
            sources.iter().enumerate().map(|(at, source)| (source.place.as_str(), at)).collect();
        let names: Vec<Names<'_>> = sources.iter().map(|it| Names::of(&it.code)).collect();
        let house = House { sources, places, names };
        let mut used = vec![BTreeSet::new(); sources.len()];
        let mut of_parents = BTreeSet::new();
        for (at, names) in house.names.iter().enumerate() {
            let imports = names.imports.iter().map(|(_, path)| path);
            for path in imports.chain(&names.paths) {
                let Some((other, item)) = house.resolve(at, path, 0) else { continue };
                let is_same_room = sources[other].room() == sources[at].room();
                if other == at || !is_same_room {
                    continue;
                }
                used[at].insert(other);
                if let Some(item) = item
                    && parent(&sources[at].place) == Some(&sources[other].place)
                {
                    of_parents.insert((at, item.to_owned()));
                }
            }
        }
        Self { used, of_parents }
    }

    /// Groups of files each of which leads to all others of its group.
    pub(super) fn circles(&self) -> Vec<Vec<usize>> {
        let count = self.used.len();
        let reached: Vec<BTreeSet<usize>> = (0..count)
            .map(|start| {
                let mut reached = BTreeSet::new();
                let mut open = vec![start];
                while let Some(at) = open.pop() {
                    open.extend(self.used[at].iter().filter(|next| reached.insert(**next)));
                }
                reached
            })
            .collect();
        let mut circles: Vec<Vec<usize>> = (0..count)
            .filter(|at| reached[*at].contains(at))
            .map(|at| {
                (0..count)
                    .filter(|other| reached[at].contains(other) && reached[*other].contains(&at))
                    .collect()
            })
            .collect();
        circles.dedup();
        circles.sort();
        circles.dedup();
        circles
    }
}

/// The module above.
fn parent(place: &str) -> Option<&str> {
    place.rsplit_once('/').map(|(parent, _)| parent)
}

struct House<'a> {
    sources: &'a [Source],
    places: BTreeMap<&'a str, usize>,
    names: Vec<Names<'a>>,
}

impl House<'_> {
    /// The file that a path leads to from another one, and the item there unless the file itself is meant;
    /// what modules only pass on is followed to where it is declared.
    fn resolve<'p>(
        &self,
        from: usize,
        path: &[&'p str],
        depth: usize,
    ) -> Option<(usize, Option<&'p str>)> {
        /// More than any item is passed on.
        const MAX_DEPTH: usize = 8;
        let mut place = self.sources[from].place.clone();
        let mut rest = path;
        match *rest.first()? {
            "crate" => {
                place = String::new();
                rest = &rest[1..];
            }
            "self" => rest = &rest[1..],
            "super" => {
                while rest.first() == Some(&"super") {
                    place = parent(&place).unwrap_or_default().to_owned();
                    rest = &rest[1..];
                }
            }
            first if self.names[from].children.contains(first) => {}
            _ => return None,
        }
        while let Some(name) = rest.first() {
            let below =
                if place.is_empty() { (*name).to_owned() } else { format!("{place}/{name}") };
            if !self.places.contains_key(below.as_str()) {
                break;
            }
            place = below;
            rest = &rest[1..];
        }
        let file = *self.places.get(place.as_str())?;
        let Some(&item) = rest.first() else { return Some((file, None)) };
        let passed_on = self.names[file].imports.iter().find(|(name, _)| *name == item);
        match passed_on {
            Some((_, path)) if depth < MAX_DEPTH => {
                let found = self.resolve(file, path, depth + 1)?;
                Some((found.0, found.1.map(|_| item)))
            }
            _ => Some((file, Some(item))),
        }
    }
}

fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

impl<'a> Names<'a> {
    fn of(code: &'a str) -> Self {
        let (mut children, mut imports, mut paths) = (BTreeSet::new(), Vec::new(), Vec::new());
        let mut rest = code;
        let mut before = ' ';
        while let Some(start) = rest.find(|c: char| is_of_name(c)) {
            before = rest[..start].chars().next_back().unwrap_or(before);
            let found = &rest[start..];
            let end = found.find(|c| !is_of_name(c)).unwrap_or(found.len());
            let (name, behind) = found.split_at(end);
            rest = behind;
            match name {
                "use" => {
                    let (tree, behind) = behind.split_once(';').unwrap_or((behind, ""));
                    expand(&[], tree, &mut imports);
                    rest = behind;
                }
                "mod" => {
                    let child = behind.trim_start();
                    let end = child.find(|c| !is_of_name(c)).unwrap_or(child.len());
                    if child[end..].starts_with(';') {
                        children.insert(&child[..end]);
                    }
                }
                // Who may see an item: `pub(in crate::...)`.
                "in" if code[..code.len() - found.len()].ends_with("pub(") => {
                    rest = behind.split_once(')').map_or("", |(_, behind)| behind);
                }
                _ if behind.starts_with("::") && before != ':' => {
                    let mut path = vec![name];
                    while let Some(next) = rest.strip_prefix("::") {
                        let end = next.find(|c| !is_of_name(c)).unwrap_or(next.len());
                        if end == 0 {
                            break;
                        }
                        path.push(&next[..end]);
                        rest = &next[end..];
                    }
                    paths.push(path);
                }
                _ => {}
            }
            before = name.chars().next_back().unwrap_or(' ');
        }
        Self { children, imports, paths }
    }
}

/// The paths of a tree of `use`, and the name that each brings into scope.
fn expand<'a>(before: &[&'a str], tree: &'a str, imports: &mut Vec<(&'a str, Vec<&'a str>)>) {
    let tree = tree.trim();
    if let Some(inside) = tree.strip_prefix('{') {
        let inside = inside.trim_end().strip_suffix('}').unwrap_or(inside);
        let (mut depth, mut start) = (0, 0);
        for (at, c) in inside.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    expand(before, &inside[start..at], imports);
                    start = at + 1;
                }
                _ => {}
            }
        }
        return expand(before, &inside[start..], imports);
    }
    let Some((first, rest)) = tree.split_once("::") else {
        let (name, new) = tree.split_once(" as ").unwrap_or((tree, tree));
        let mut path = before.to_vec();
        let new = match name.trim() {
            "" => return,
            "self" if !before.is_empty() => before[before.len() - 1],
            name => {
                path.push(name);
                new.trim()
            }
        };
        return imports.push((new, path));
    };
    expand(&[before, &[first.trim()]].concat(), rest, imports);
}

/// Methods of each type: functions in all blocks of its own and of traits, by the file that declares it.
pub(super) fn methods(sources: &[Source]) -> BTreeMap<String, usize> {
    let places: BTreeMap<&str, usize> =
        sources.iter().enumerate().map(|(at, source)| (source.place.as_str(), at)).collect();
    let names = sources.iter().map(|it| Names::of(&it.code)).collect();
    let house = House { sources, places, names };
    let mut methods = BTreeMap::new();
    for (at, source) in sources.iter().enumerate() {
        for (name, block) in impls(&source.code) {
            let imported = house.names[at].imports.iter().find(|(other, _)| *other == name);
            let file =
                imported.and_then(|(_, path)| house.resolve(at, path, 0)).map_or(at, |it| it.0);
            *methods.entry(format!("{}: {name}", sources[file].place)).or_default() +=
                functions(block);
        }
    }
    methods
}

/// Names of types and what is in their blocks.
fn impls(code: &str) -> impl Iterator<Item = (&str, &str)> {
    let starts = code
        .match_indices("\nimpl")
        .filter(|(at, word)| code[at + word.len()..].starts_with([' ', '<']));
    starts.filter_map(|(at, _)| {
        let item = &code[at + 5..];
        let (head, _) = item.split_once('{')?;
        let block = &item[head.len()..];
        let block = &block[..super::source::block_length(block)];
        // Behind the generics, and behind `for` of a trait.
        let head = head.split(" where").next()?;
        let head = head.rsplit(" for ").next()?.trim_start();
        let head = if head.starts_with('<') { behind_generics(head) } else { head };
        let name = head.trim().split('<').next()?.rsplit("::").next()?;
        Some((name.trim_start_matches(['&', '\'']), block))
    })
}

fn behind_generics(head: &str) -> &str {
    let mut depth = 0;
    for (at, c) in head.char_indices() {
        match c {
            '<' => depth += 1,
            '>' if !head[..at].ends_with('-') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return &head[at + 1..];
        }
    }
    head
}

/// Functions of a block, but for those within functions.
fn functions(block: &str) -> usize {
    let (mut depth, mut count) = (0, 0);
    for (at, c) in block.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            'f' if depth == 1
                && block[at..].starts_with("fn ")
                && !block[..at].ends_with(is_of_name) =>
            {
                count += 1;
            }
            _ => {}
        }
    }
    count
}

#[test]
fn what_is_passed_on_is_followed_to_where_it_is_declared() {
    let source = |place: &str, code: &str| Source { place: place.into(), code: code.into() };
    let sources = [
        source("r", "mod a;\nmod b;\nmod c;\npub use a::{Y, W as V};\nstruct Z;\n"),
        source("r/a", "use super::b;\nstruct Y;\nimpl<'a> Y<'a> { fn f() { fn inner() {} } }\n"),
        source("r/b", "pub(in crate::r) struct X;\nfn g() { super::V::new() }\n"),
        source("r/c", "use super::{\n    Y, Z,\n};\nimpl Clone for Y {\n    fn h() {}\n}\n"),
    ];
    let imports = Imports::of(&sources);
    let used: Vec<Vec<usize>> =
        imports.used.iter().map(|used| used.iter().copied().collect()).collect();
    assert_eq!(used, [vec![1], vec![2], vec![1], vec![0, 1]]);
    assert_eq!(imports.of_parents.into_iter().collect::<Vec<_>>(), [(3, "Z".to_owned())]);
    assert_eq!(Imports::of(&sources).circles(), [[1, 2]]);
    assert_eq!(methods(&sources).into_iter().collect::<Vec<_>>(), [("r/a: Y".to_owned(), 2)]);
}
