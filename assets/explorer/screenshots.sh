#!/usr/bin/env bash
# Makes screenshots of the states of the explorer's page: assets/explorer/pictures/*.png.
# Needs chromium and chromedriver (Debian: chromium, chromium-driver).
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo test --release --test explorer -- --ignored --nocapture pictures
ls -l assets/explorer/pictures
