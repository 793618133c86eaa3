//! The header is what cbindgen makes of the sources. `ZR_RENEW=1 cargo test -p zerorate-c` writes
//! it again.

use std::fs;
use std::path::Path;

#[test]
fn the_header_is_that_of_the_sources() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("its settings");
    let mut made = Vec::new();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for source in ["code.rs", "drift.rs", "attitude.rs"] {
        builder = builder.with_src(root.join("src").join(source));
    }
    builder.generate().expect("the sources are understood").write(&mut made);
    let header = root.join("include/zerorate.h");
    if std::env::var_os("ZR_RENEW").is_some() {
        fs::write(&header, &made).expect("the header can be written");
    }
    let stands = fs::read_to_string(&header).expect("the header is there");
    assert!(stands.into_bytes() == made, "ZR_RENEW=1 cargo test -p zerorate-c writes it again");
}
