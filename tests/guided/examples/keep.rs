//! `keep TARGET FOLDER...` keeps the inputs in some folders, such as those that `-merge=1 -set_cover_merge=1`
//! has chosen and those that failed.

use std::fs;
use std::path::Path;

fn main() {
    let mut words = std::env::args().skip(1);
    let target = words.next().expect("a target");
    let mut inputs: Vec<Vec<u8>> = words
        .flat_map(|folder| fs::read_dir(folder).expect("a folder"))
        .map(|entry| fs::read(entry.expect("a file").path()).expect("read"))
        .collect();
    inputs.sort();
    inputs.dedup();
    let behind_length = |input: &Vec<u8>| [&(input.len() as u32).to_le_bytes(), &input[..]].concat();
    let all: Vec<u8> = inputs.iter().flat_map(behind_length).collect();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("kept").join(&target);
    fs::write(&file, &all).expect("written");
    println!("{}: {} inputs, {} bytes", file.display(), inputs.len(), all.len());
}
