//! In the place of commands that this build leaves out: whatever words follow one, it says which feature
//! would bring it.

use std::ffi::OsString;

/// Arguments of a command that is not there.
#[derive(Debug, Default, clap::Args)]
#[command(disable_help_flag = true)]
pub(super) struct Words {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    words: Vec<OsString>,
}

/// Declares what stands in a command's place.
macro_rules! absent {
    ($name:ident, $arguments:ident, $sentence:literal) => {
        pub(super) mod $name {
            pub(in crate::cli) use crate::cli::absent::Words as $arguments;
            use crate::error::{Error, Result};

            pub(in crate::cli) fn run(_: &$arguments) -> Result<()> {
                Err(Error::new(concat!("this lightgrid was built without ", $sentence)))
            }
        }
    };
}

#[cfg(not(feature = "window"))]
absent!(view, ViewArguments, "a window (feature `window`); lightgrid --help lists what it can do");
#[cfg(not(feature = "window"))]
absent!(screenshot, ScreenshotArguments, "a window (feature `window`)");
#[cfg(not(feature = "report"))]
absent!(bench, BenchArguments, "measurements (feature `report`)");
#[cfg(not(feature = "report"))]
absent!(report, ReportArguments, "measurements (feature `report`)");
#[cfg(not(feature = "report"))]
absent!(stability, StabilityArguments, "measurements (feature `report`)");

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use crate::cli::{Arguments, run};

    #[test]
    fn what_is_not_built_in_says_so() {
        for (line, feature, is_built_in) in [
            ("lightgrid", "`window`", cfg!(feature = "window")),
            ("lightgrid view office --env sky:day", "`window`", cfg!(feature = "window")),
            ("lightgrid screenshot --help", "`window`", cfg!(feature = "window")),
            ("lightgrid report talk -o x", "`report`", cfg!(feature = "report")),
            ("lightgrid bench office", "`report`", cfg!(feature = "report")),
            ("lightgrid stability --list", "`report`", cfg!(feature = "report")),
            ("lightgrid render open --device gpu -o x.png", "`gpu`", cfg!(feature = "gpu")),
        ] {
            if is_built_in {
                continue;
            }
            let arguments = Arguments::try_parse_from(line.split(' ')).expect("it is understood");
            let says = run(arguments).expect_err("it is not there").to_string();
            assert!(says.starts_with("this lightgrid was built without"), "{line}: {says}");
            assert!(says.contains(feature), "{line}: {says}");
        }
    }
}
