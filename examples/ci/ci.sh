#!/bin/sh
# Checks the tables and the configuration of the machine, and compares what they make of its frames with the golden texts.
# Needs nothing but `axisbridge`. Run it by hand, from the hook, or from the code host.
set -eu
cd "$(dirname "$0")"

axisbridge check --config config.toml

# For the code host's report of tests, and for people if something differs.
mkdir -p target
axisbridge snapshot frames --config config.toml --format junit > target/frames.xml ||
    { axisbridge snapshot frames --config config.toml; exit 1; }

# Every value of the recording, one JSON object a line, for scripts of your own.
axisbridge translate frames/first-move.pcapng --config config.toml --format ndjson > target/first-move.ndjson
