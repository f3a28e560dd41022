"""What the fuzzers have found is kept in the tree, and stays small there: corpus_size.py SOURCE_FOLDER."""

import pathlib
import sys

MOST_BYTES = 3_000_000


def main():
    corpus = pathlib.Path(sys.argv[1]) / "tests/fuzz/corpus"
    sizes = {file: file.stat().st_size for file in corpus.rglob("*") if file.is_file()}
    if not sizes:
        sys.exit(f"{corpus}: there is no corpus")
    total = sum(sizes.values())
    print(f"{len(sizes)} inputs, {total} bytes")
    if total > MOST_BYTES:
        largest = sorted(sizes, key=sizes.get, reverse=True)[:10]
        sys.exit("\n".join([f"tests/fuzz/corpus has more than {MOST_BYTES} bytes; make it smaller with -merge=1 (tests/fuzz/CMakeLists.txt). "
                            "Its largest inputs:", *(f"  {sizes[file]:>8} {file.relative_to(corpus)}" for file in largest)]))


main()
