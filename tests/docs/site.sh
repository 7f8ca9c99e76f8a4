#!/usr/bin/env bash
# site.sh SOURCE SCRATCH PYTHON: the site is built without a warning, its links are right, and a wrong one is noticed.
set -euo pipefail
source=$1 site=$2/site python=$3
"$source/run" docs --build "$site"
"$python" "$source/tests/docs/check_site.py" "$site"

cp "$site/index.html" "$2/index.html"
trap 'cp "$2/index.html" "$site/index.html"' EXIT
for wrong in nowhere/ guide/world/#no-such-place; do
    sed "s|</article>|<a href=\"$wrong\">x</a>&|" "$2/index.html" >"$site/index.html"
    if found=$("$python" "$source/tests/docs/check_site.py" "$site") || [[ $found != *"1 of them wrong"* ]]; then
        echo "a link to $wrong wasn't noticed: $found"
        exit 1
    fi
done

mkdir -p "$2/other" && touch "$2/other/letter"
if "$source/run" docs --build "$2/other" 2>/dev/null || [ ! -f "$2/other/letter" ]; then
    echo "./run docs --build deleted a file that wasn't its own"
    exit 1
fi
