/* paper_page.h - the page of `make paper`: fixed text with the fragments of the parts, and the stamp that dates them. */
#ifndef BENCH_PAPER_PAGE_H
#define BENCH_PAPER_PAGE_H

#include <stdbool.h>
#include <stdio.h>

enum { PAPER_STAMP = 120 };

/* Describes the library that a part's figures come from: for each set of parameters a hash of the values that are not 0, and the
   state after a small run. "" if the run fails. */
void paper_stamp(char stamp[PAPER_STAMP]);

/* Begin and end the section of a part: comments of Markdown. */
void paper_section_begin(FILE *file, const char *part, const char *stamp);
void paper_section_end(FILE *file, const char *part);

/* Finds a part's section in a page, comments included. Returns its length, and 0 if there is none. */
size_t paper_section_find(const char *page, const char *part, const char **section);

/* Copies the stamp of a section. Returns false if it has none. */
bool paper_section_stamp(const char *section, char stamp[PAPER_STAMP]);

/* Puts a page together: `text` with each line <!-- part NAME --> replaced by the section of that part, which `section_of` returns
   as a string to be freed, or NULL: then a line has the command that makes it. The result is to be freed; NULL: memory is short. */
typedef char *(*paper_section_fn)(void *user, const char *part);
char *paper_page(const char *text, paper_section_fn section_of, void *user);

#endif
