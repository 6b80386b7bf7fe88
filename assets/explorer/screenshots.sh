#!/usr/bin/env bash
# Makes pictures of the explorer's page in its states: assets/explorer/pictures/*.png.
# Needs chromium and chromedriver (Debian: chromium, chromium-driver).
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo test --release --test explorer -- --ignored --nocapture pictures
ls -l assets/explorer/pictures
