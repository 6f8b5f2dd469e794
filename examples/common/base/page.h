/* page.h - an HTML page of headings, texts, tables and pictures stored beside it. No JavaScript; text is escaped. */
#ifndef EXAMPLES_BASE_PAGE_H
#define EXAMPLES_BASE_PAGE_H

#include <stdbool.h>
#include <stdio.h>

struct page {
    FILE *file;
    const char *path;
};

/* Creates the file; returns false on failure. page_close returns whether everything was written; else no part of the file stays. The
 * path has to last until then. */
bool page_open(struct page *page, const char *path, const char *title);
bool page_close(struct page *page);

void page_heading(struct page *page, int level, const char *text);
void page_text(struct page *page, const char *text);
void page_code(struct page *page, const char *text);
void page_failure(struct page *page, const char *text); /* highlighted */

/* Begins a table, whose first row names the columns. */
void page_table_begin(struct page *page);
void page_row(struct page *page, bool is_head, const char *const *cells, int count);
void page_table_end(struct page *page);

/* Adds a picture; `source` is the path of the PNG relative to the page. */
void page_picture(struct page *page, const char *source, const char *caption);

/* Escapes text for an element or a quoted attribute; control characters become '?'. */
void page_escape(FILE *file, const char *text);

#endif
