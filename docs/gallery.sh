#!/usr/bin/env bash
# Runs every preset, draws a picture of each, and writes docs/gallery.md:
#   docs/gallery.sh target/release/grainscope
set -euo pipefail
program=$(realpath "${1:?give the path of the program}")
cd "$(dirname "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p gallery
page=gallery.md
cat > "$page" << 'HEAD'
# Gallery of scenes

Every preset, with the command and the time that it took. `docs/gallery.sh target/release/grainscope` makes
this page and its pictures; the times are those of two processors that other programs used, too.
`grainscope presets show <name>` prints a scene, `grainscope explore <name>` lets you change it.
HEAD
for name in $("$program" presets | awk '{print $1}'); do
    "$program" run "$name" --out "$work/$name" > /dev/null 2>&1
    # Presets with layers or a stress field show more in a field than in their particles.
    case $name in
        shear_alignment) look=(--colour alignment) ;;
        couette_cosserat | poiseuille_cosserat) look=(--field rotation) ;;
        solcx | solvi) look=(--field pressure) ;;
        hopper) look=(--colour speed) ;;
        flow_past_cylinder) look=(--field speed) ;;
        layer_stack) look=(--field speed) ;;
        *) look=() ;;
    esac
    "$program" film "$work/$name" -o "$work/$name.png" --frames 4 --width 560 "${look[@]}" > /dev/null
    mv "$work/${name}_00001.png" "gallery/$name.png"
    about=$(sed -n 's/^description = "\(.*\)"$/\1/p' "$work/$name/scene.toml")
    steps=$(sed -n 's/^  "steps": \([0-9]*\),$/\1/p' "$work/$name/summary.json")
    seconds=$(sed -n 's/^    "total": \([0-9.]*\)$/\1/p' "$work/$name/summary.json" | tail -1)
    {
        printf '\n## `%s`\n\n%s\n\n![%s](gallery/%s.png)\n\n' "$name" "$about" "$name" "$name"
        printf '```sh\ngrainscope run %s\n' "$name"
        printf 'grainscope film runs/%s -o %s.png --frames 4' "$name" "$name"
        [ ${#look[@]} -eq 0 ] || printf ' %s' "${look[@]}"
        printf '\n```\n\n%s steps, %.1f s; the second of the pictures.\n' "$steps" "$seconds"
    } >> "$page"
done
