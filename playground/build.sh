#!/usr/bin/env bash
# The playground as static files in playground/dist: serve them with anything, `python3 -m http.server -d playground/dist`.
set -euo pipefail
cd "$(dirname "$0")"

version=$(sed -n 's/^wasm-bindgen = "=\(.*\)"$/\1/p' Cargo.toml)
target=wasm32-unknown-unknown
tools="$PWD/../target/tools"
PATH="$tools/bin:$PATH"

left_out() { echo "the playground is left out: $1" >&2; exit 3; }
[ -d "$(rustc --print sysroot)/lib/rustlib/$target" ] || timeout 300 rustup target add $target || left_out "no Rust target $target"
if [ "$(wasm-bindgen --version 2>/dev/null)" != "wasm-bindgen $version" ]; then
  # Built for a quick start: it runs once.
  cargo install --quiet --debug --root "$tools" wasm-bindgen-cli --version "$version" || left_out "no wasm-bindgen $version"
fi

cargo build --profile playground --target $target
rm -rf dist && mkdir dist
wasm-bindgen --target web --no-typescript --remove-name-section --out-dir dist "../target/$target/playground/circ_playground.wasm"
if command -v wasm-opt >/dev/null; then
  wasm-opt -Os --all-features -o dist/opt.wasm dist/circ_playground_bg.wasm && mv dist/opt.wasm dist/circ_playground_bg.wasm
fi
cp -r site/. dist/
mkdir dist/page && cp -r ../src/report/page/uplot ../src/report/page/*.js ../src/report/page/page.css dist/page/
python3 - <<'PYTHON'
import json, pathlib
files = sorted(pathlib.Path("../netlists").glob("*.cir"))
examples = [{"name": f.stem, "title": f.read_text().splitlines()[0].lstrip("* "), "netlist": f.read_text()} for f in files]
pathlib.Path("dist/examples.json").write_text(json.dumps(examples, ensure_ascii=False))
PYTHON
echo "playground/dist: $(find dist -type f -exec gzip -9 -c {} \; | wc -c) bytes compressed"
